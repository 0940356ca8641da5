//! The state of graphics pipelines that passes set.

use ash::vk;

use super::blend::Blend;
use super::depth_stencil::DepthState;
use super::graphics_desc::RenderPipelineDesc;
use super::rasterization::DepthBias;
use crate::gpu::caps::shading_rate::ShadingRate;

/// The state that is not part of the pipeline. The pass sets it when the pipeline is bound.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct PassState {
    /// Default depth state; `None` without a depth test.
    pub(crate) depth: Option<DepthState>,
    /// Default depth bias; `None` without a depth bias.
    pub(crate) bias: Option<DepthBias>,
    /// True if the pipeline tests stencil against the pass's reference.
    pub(crate) stencil: bool,
    /// True if the pipeline blends with the pass's constants.
    pub(crate) blend_constants: bool,
    /// Default shading rate; `None` for pipelines without a shading rate.
    pub(crate) shading_rate: Option<ShadingRate>,
}

impl PassState {
    pub(super) fn from_desc(desc: &RenderPipelineDesc<'_>) -> Self {
        let blends = desc.color.iter().filter_map(|target| target.blend);
        Self {
            depth: desc.depth.map(|depth| depth.dynamic_state()),
            bias: desc.depth_bias,
            stencil: desc.stencil.is_some(),
            blend_constants: blends.into_iter().any(Blend::uses_constants),
            shading_rate: desc.shading_rate,
        }
    }

    pub(super) fn dynamic_states(&self) -> Vec<vk::DynamicState> {
        use vk::DynamicState as Raw;
        let mut states = vec![Raw::VIEWPORT, Raw::SCISSOR];
        if self.depth.is_some() {
            states.extend([Raw::DEPTH_WRITE_ENABLE, Raw::DEPTH_COMPARE_OP]);
        }
        let rest = [
            (self.bias.is_some(), Raw::DEPTH_BIAS),
            (self.stencil, Raw::STENCIL_REFERENCE),
            (self.blend_constants, Raw::BLEND_CONSTANTS),
            (self.shading_rate.is_some(), Raw::FRAGMENT_SHADING_RATE_KHR),
        ];
        states.extend(rest.iter().filter(|(on, _)| *on).map(|(_, state)| *state));
        states
    }
}
