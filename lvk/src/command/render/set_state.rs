//! Commands that set a render pass's dynamic state.

use ash::vk;

use super::dynamic_state::{DynamicValues, READ_ONLY_DEPTH_ERROR};
use super::pass::RenderPass;
use crate::error::{Error, Result};
use crate::gpu::caps::optional_features::OptionalFeature;
use crate::gpu::caps::portability::PortabilityNeed;
use crate::gpu::caps::shading_rate::ShadingRate;
use crate::pipeline::PassState;
use crate::pipeline::depth_stencil::DepthState;
use crate::pipeline::rasterization::DepthBias;

const SEPARATE_REFERENCES: PortabilityNeed = PortabilityNeed::new(
    OptionalFeature::SeparateStencilReference,
    "different stencil references of front and back faces",
    "draw front and back faces one after the other, each with its reference",
);

impl RenderPass<'_> {
    /// Sets the stencil references of front and of back faces, for this and later pipelines of the pass
    /// (`vkCmdSetStencilReference`). Stencil values are compared with them and replaced by them. 0 at the begin of a
    /// pass.
    ///
    /// # Errors
    /// [`Unsupported`](Error::Unsupported) if they differ on a device without
    /// [`OptionalFeature::SeparateStencilReference`](crate::OptionalFeature::SeparateStencilReference).
    pub fn stencil_reference(&mut self, front: u8, back: u8) -> Result<()> {
        self.cmd.shared.gpu.require_portable("the pass", (front != back).then_some(SEPARATE_REFERENCES))?;
        self.dynamic.stencil_reference = [front, back];
        if self.dynamic.current.stencil_reference.is_some() {
            self.dynamic.current.stencil_reference = Some([front, back]);
            self.set_values(&DynamicValues { stencil_reference: Some([front, back]), ..Default::default() });
        }
        Ok(())
    }

    /// Sets the constants of [`BlendFactor::ConstantColor`](crate::BlendFactor::ConstantColor) and the other constant
    /// factors, for this and later pipelines of the pass (`vkCmdSetBlendConstants`). 0 at the begin of a pass.
    pub fn blend_constants(&mut self, constants: [f32; 4]) {
        self.dynamic.blend_constants = constants;
        if self.dynamic.current.blend_constants.is_some() {
            self.dynamic.current.blend_constants = Some(constants);
            self.set_values(&DynamicValues { blend_constants: Some(constants), ..Default::default() });
        }
    }

    /// Replaces the depth test of the bound pipeline until a pipeline is bound (`vkCmdSetDepthCompareOp`,
    /// `vkCmdSetDepthWriteEnable`).
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) unless a pipeline with a depth test is bound, and for writes in a pass
    /// whose depth target is read-only.
    pub fn depth_state(&mut self, state: DepthState) -> Result<()> {
        let pipeline = self.bound_pipeline("depth_state")?;
        if pipeline.pass_state.depth.is_none() {
            return Err(Error::usage(&*pipeline.name, "it has no depth test to replace; create it with one"));
        }
        if state.write && self.targets.read_only_depth {
            return Err(Error::usage(&*pipeline.name, READ_ONLY_DEPTH_ERROR));
        }
        if state.write {
            self.write_depth()?;
        }
        let values = DynamicValues { depth: Some(state), ..Default::default() };
        self.dynamic.current.depth = values.depth;
        self.set_values(&values);
        Ok(())
    }

    /// Replaces the depth bias of the bound pipeline until a pipeline is bound (`vkCmdSetDepthBias`).
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) unless a pipeline with a depth bias is bound, and for values that are not
    /// finite; [`Unsupported`](Error::Unsupported) for a clamp without
    /// [`OptionalFeature::DepthBiasClamp`](crate::OptionalFeature::DepthBiasClamp).
    pub fn depth_bias(&mut self, bias: DepthBias) -> Result<()> {
        let pipeline = self.bound_pipeline("depth_bias")?;
        if pipeline.pass_state.bias.is_none() || !bias.is_finite() {
            let message =
                format!("{bias:?} needs a pipeline that was created with a depth bias, and finite numbers");
            return Err(Error::usage(&*pipeline.name, message));
        }
        if bias.clamp != 0.0 {
            self.cmd.shared.gpu.require(OptionalFeature::DepthBiasClamp, "a depth bias with a bound")?;
        }
        let values = DynamicValues { bias: Some(bias), ..Default::default() };
        self.dynamic.current.bias = values.bias;
        self.set_values(&values);
        Ok(())
    }

    /// Sets the shading rate of the draws that follow. The device must support it.
    pub(super) fn set_shading_rate(&mut self, rate: ShadingRate) {
        let values = DynamicValues { shading_rate: Some(rate), ..Default::default() };
        self.dynamic.current.shading_rate = values.shading_rate;
        self.set_values(&values);
    }

    /// Sets the dynamic state of the pipeline that was just bound.
    pub(super) fn set_pipeline_state(&mut self, state: &PassState) {
        let values = self.dynamic.values_for_pipeline(state);
        if values != DynamicValues::default() {
            self.set_values(&values);
        }
    }

    fn set_values(&self, values: &DynamicValues) {
        let (device, raw) = (&self.cmd.shared.gpu.device, self.cmd.raw());
        // SAFETY: the command buffer is being recorded, and the device supports each state: those of depth are core,
        // and state that needs a feature was rejected without it.
        unsafe {
            if let Some(DepthState { compare, write }) = values.depth {
                device.cmd_set_depth_compare_op(raw, compare.raw());
                device.cmd_set_depth_write_enable(raw, write);
            }
            if let Some(DepthBias { constant, slope, clamp }) = values.bias {
                device.cmd_set_depth_bias(raw, constant, clamp, slope);
            }
            if let Some([front, back]) = values.stencil_reference {
                device.cmd_set_stencil_reference(raw, vk::StencilFaceFlags::FRONT, front.into());
                device.cmd_set_stencil_reference(raw, vk::StencilFaceFlags::BACK, back.into());
            }
            if let Some(constants) = values.blend_constants {
                device.cmd_set_blend_constants(raw, &constants);
            }
            if let (Some(rate), Some(rates)) = (values.shading_rate, &self.cmd.shared.gpu.shading_rates) {
                let set = rates.functions.fp().cmd_set_fragment_shading_rate_khr;
                set(raw, &rate.raw_size(), &rate.raw_combine());
            }
        }
    }
}
