//! Depth and stencil tests.

use ash::vk;

use crate::format::Format;
use crate::resource::sampler::CompareOp;

/// Depth test of a pipeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct DepthTest {
    /// Format of the depth target.
    pub format: Format,
    /// Comparison of the fragment's depth with the target's depth. A fragment passes if the comparison is true.
    pub compare: CompareOp,
    /// True if passing fragments write their depth.
    pub write: bool,
}

impl DepthTest {
    /// Returns the state that a pass may replace.
    pub(crate) fn dynamic_state(&self) -> DepthState {
        DepthState { compare: self.compare, write: self.write }
    }
}

/// A depth test that replaces the pipeline's own; see [`RenderPass::depth_state`](crate::RenderPass::depth_state).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct DepthState {
    /// Comparison of the fragment's depth with the target's depth. A fragment passes if the comparison is true.
    pub compare: CompareOp,
    /// True if passing fragments write their depth.
    pub write: bool,
}

/// An operation on a stencil value (`VkStencilOp`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum StencilOp {
    /// Keeps the value.
    #[default]
    Keep,
    /// Sets 0.
    Zero,
    /// Sets the reference.
    Replace,
    /// Adds 1, up to 255.
    IncrementClamp,
    /// Subtracts 1, down to 0.
    DecrementClamp,
    /// Inverts all bits.
    Invert,
    /// Adds 1; 255 becomes 0.
    IncrementWrap,
    /// Subtracts 1; 0 becomes 255.
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

/// Stencil test of front or back faces. The default always passes and changes nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct StencilFace {
    /// Comparison of the reference with the target's value, both masked by [`read_mask`](Self::read_mask). A fragment
    /// passes if the comparison is true. Default: [`CompareOp::Always`].
    pub compare: CompareOp,
    /// Operation if a fragment fails the stencil test. Default: [`StencilOp::Keep`].
    pub fail: StencilOp,
    /// Operation if a fragment passes the stencil test and fails the depth test. Default: [`StencilOp::Keep`].
    pub depth_fail: StencilOp,
    /// Operation if a fragment passes both tests. Default: [`StencilOp::Keep`].
    pub pass: StencilOp,
    /// Bits that are compared. Default: `u8::MAX`, all bits.
    pub read_mask: u8,
    /// Bits that are written. Default: `u8::MAX`, all bits.
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

/// Stencil test of a pipeline. The reference is
/// [`RenderPass::stencil_reference`](crate::RenderPass::stencil_reference).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct StencilTest {
    /// Test of front faces, lines and points. Default: the default [`StencilFace`].
    pub front: StencilFace,
    /// Test of back faces. Default: the default [`StencilFace`].
    pub back: StencilFace,
}

impl StencilTest {
    /// Returns the same test for front and back faces.
    pub const fn both(face: StencilFace) -> Self {
        Self { front: face, back: face }
    }

    /// True if the test may change stencil values.
    pub(crate) fn writes(&self) -> bool {
        self.front.writes() || self.back.writes()
    }
}

/// Returns Vulkan's state of both tests.
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
