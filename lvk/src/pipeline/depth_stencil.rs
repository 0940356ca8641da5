//! Depth and stencil tests.

use ash::vk;

use crate::format::Format;
use crate::resource::sampler::CompareOp;

/// Depth test of a pipeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct DepthTest {
    /// Format of the depth target.
    pub format: Format,
    /// A fragment passes if its depth compares so with the target's.
    pub compare: CompareOp,
    /// Whether passing fragments write their depth.
    pub write: bool,
}

impl DepthTest {
    /// The part that a pass may replace.
    pub(crate) fn dynamic_state(&self) -> DepthState {
        DepthState { compare: self.compare, write: self.write }
    }
}

/// A depth test in place of the pipeline's own; see [`RenderPass::depth_state`](crate::RenderPass::depth_state).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct DepthState {
    /// A fragment passes if its depth compares so with the target's.
    pub compare: CompareOp,
    /// Whether passing fragments write their depth.
    pub write: bool,
}

/// What becomes of a stencil value (`VkStencilOp`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum StencilOp {
    /// It stays.
    #[default]
    Keep,
    /// 0.
    Zero,
    /// The reference.
    Replace,
    /// One more, at most 255.
    IncrementClamp,
    /// One less, at least 0.
    DecrementClamp,
    /// All bits inverted.
    Invert,
    /// One more, and 0 behind 255.
    IncrementWrap,
    /// One less, and 255 behind 0.
    DecrementWrap,
}

impl StencilOp {
    fn raw(self) -> vk::StencilOp {
        match self {
            Self::Keep => vk::StencilOp::KEEP,
            Self::Zero => vk::StencilOp::ZERO,
            Self::Replace => vk::StencilOp::REPLACE,
            Self::IncrementClamp => vk::StencilOp::INCREMENT_AND_CLAMP,
            Self::DecrementClamp => vk::StencilOp::DECREMENT_AND_CLAMP,
            Self::Invert => vk::StencilOp::INVERT,
            Self::IncrementWrap => vk::StencilOp::INCREMENT_AND_WRAP,
            Self::DecrementWrap => vk::StencilOp::DECREMENT_AND_WRAP,
        }
    }
}

/// Stencil test of the faces of one side. The default passes and changes nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct StencilFace {
    /// A fragment passes if the reference compares so with the target's value, both masked by
    /// [`read_mask`](Self::read_mask).
    pub compare: CompareOp,
    /// What becomes of the value where a fragment fails.
    pub fail: StencilOp,
    /// Where it passes here and fails the depth test.
    pub depth_fail: StencilOp,
    /// Where it passes both.
    pub pass: StencilOp,
    /// Bits that are compared.
    pub read_mask: u8,
    /// Bits that are written.
    pub write_mask: u8,
}

impl Default for StencilFace {
    fn default() -> Self {
        Self {
            compare: CompareOp::Always,
            fail: StencilOp::Keep,
            depth_fail: StencilOp::Keep,
            pass: StencilOp::Keep,
            read_mask: u8::MAX,
            write_mask: u8::MAX,
        }
    }
}

impl StencilFace {
    fn writes(&self) -> bool {
        let ops = [self.fail, self.depth_fail, self.pass];
        self.write_mask != 0 && ops.iter().any(|op| *op != StencilOp::Keep)
    }

    fn raw(&self) -> vk::StencilOpState {
        vk::StencilOpState {
            fail_op: self.fail.raw(),
            pass_op: self.pass.raw(),
            depth_fail_op: self.depth_fail.raw(),
            compare_op: self.compare.raw(),
            compare_mask: self.read_mask.into(),
            write_mask: self.write_mask.into(),
            reference: 0,
        }
    }
}

/// Stencil test of a pipeline. The reference is that of
/// [`RenderPass::stencil_reference`](crate::RenderPass::stencil_reference).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct StencilTest {
    /// Of front faces, lines and points.
    pub front: StencilFace,
    /// Of back faces.
    pub back: StencilFace,
}

impl StencilTest {
    /// Both sides alike.
    pub const fn both(face: StencilFace) -> Self {
        Self { front: face, back: face }
    }

    /// Whether any value may change.
    pub(crate) fn writes(&self) -> bool {
        self.front.writes() || self.back.writes()
    }
}

/// What Vulkan takes for both tests.
pub(super) fn depth_stencil_state(
    depth: Option<DepthTest>,
    stencil: Option<StencilTest>,
) -> vk::PipelineDepthStencilStateCreateInfo<'static> {
    let mut state = vk::PipelineDepthStencilStateCreateInfo::default();
    if let Some(depth) = depth {
        state = state
            .depth_test_enable(true)
            .depth_write_enable(depth.write)
            .depth_compare_op(depth.compare.raw());
    }
    match stencil {
        Some(test) => state.stencil_test_enable(true).front(test.front.raw()).back(test.back.raw()),
        None => state,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_test_writes_where_some_operation_changes_a_bit() {
        let keep = StencilFace::default();
        assert!(!StencilTest::both(keep).writes());
        let replace = StencilFace { depth_fail: StencilOp::Replace, ..keep };
        assert!(StencilTest { back: replace, ..Default::default() }.writes());
        assert!(!StencilTest::both(StencilFace { write_mask: 0, ..replace }).writes());
    }
}
