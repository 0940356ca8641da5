//! State that a render pass sets in place of its pipelines.

use ash::vk;

use super::render_pass::RenderPass;
use crate::error::{Error, Result};
use crate::gpu::caps::optional_features::OptionalFeature;
use crate::gpu::caps::shading_rate::ShadingRate;
use crate::pipeline::PassState;
use crate::pipeline::depth_stencil::DepthState;
use crate::pipeline::rasterization::DepthBias;

/// What the pass wants, and what Vulkan's command buffer holds.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct DynamicState {
    stencil_reference: [u8; 2],
    blend_constants: [f32; 4],
    current: DynamicValues,
}

/// Values by state; `None` for one that is not to be set, or is not known.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct DynamicValues {
    depth: Option<DepthState>,
    bias: Option<DepthBias>,
    stencil_reference: Option<[u8; 2]>,
    blend_constants: Option<[f32; 4]>,
    shading_rate: Option<ShadingRate>,
}

impl DynamicState {
    /// Whether draws write depth as things stand.
    pub(super) fn writes_depth(&self) -> bool {
        self.current.depth.is_some_and(|state| state.write)
    }

    /// What has to be set for a pipeline that leaves `state` to the pass. What a pipeline does not leave is its own, and
    /// forgotten behind it.
    fn values_for_pipeline(&mut self, state: &PassState) -> DynamicValues {
        let wanted = DynamicValues {
            depth: state.depth,
            bias: state.bias,
            stencil_reference: state.stencil.then_some(self.stencil_reference),
            blend_constants: state.blend_constants.then_some(self.blend_constants),
            shading_rate: state.shading_rate,
        };
        let held = std::mem::replace(&mut self.current, wanted);
        DynamicValues {
            depth: if_changed(wanted.depth, held.depth),
            bias: if_changed(wanted.bias, held.bias),
            stencil_reference: if_changed(wanted.stencil_reference, held.stencil_reference),
            blend_constants: if_changed(wanted.blend_constants, held.blend_constants),
            shading_rate: if_changed(wanted.shading_rate, held.shading_rate),
        }
    }
}

/// The value where it is to be set and another one is held.
fn if_changed<T: PartialEq>(wanted: Option<T>, held: Option<T>) -> Option<T> {
    if wanted == held { None } else { wanted }
}

impl RenderPass<'_> {
    /// The reference that stencil values are compared with and replaced by, of front and of back faces, for this and later
    /// pipelines of the pass (`vkCmdSetStencilReference`). 0 at the begin of a pass.
    pub fn stencil_reference(&mut self, front: u8, back: u8) {
        self.dynamic.stencil_reference = [front, back];
        if self.dynamic.current.stencil_reference.is_some() {
            self.dynamic.current.stencil_reference = Some([front, back]);
            self.set_values(&DynamicValues { stencil_reference: Some([front, back]), ..Default::default() });
        }
    }

    /// The constants of [`BlendFactor::ConstantColor`](crate::BlendFactor::ConstantColor) and its kin, for this and later pipelines
    /// of the pass (`vkCmdSetBlendConstants`). 0 at the begin of a pass.
    pub fn blend_constants(&mut self, constants: [f32; 4]) {
        self.dynamic.blend_constants = constants;
        if self.dynamic.current.blend_constants.is_some() {
            self.dynamic.current.blend_constants = Some(constants);
            self.set_values(&DynamicValues { blend_constants: Some(constants), ..Default::default() });
        }
    }

    /// Another depth test than that of the bound pipeline, until a pipeline is bound (`vkCmdSetDepthCompareOp`,
    /// `vkCmdSetDepthWriteEnable`).
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) unless a pipeline with a depth test is bound, and for writes in a pass whose
    /// depth target is read-only.
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

    /// Another depth bias than that of the bound pipeline, until a pipeline is bound (`vkCmdSetDepthBias`).
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) unless a pipeline with a depth bias is bound, and for parts that are no
    /// numbers; [`Unsupported`](Error::Unsupported) for a bound without
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

    /// The rate of the draws that follow, which the device has.
    pub(super) fn set_shading_rate(&mut self, rate: ShadingRate) {
        let values = DynamicValues { shading_rate: Some(rate), ..Default::default() };
        self.dynamic.current.shading_rate = values.shading_rate;
        self.set_values(&values);
    }

    /// Sets what the pipeline that was bound now leaves to the pass.
    pub(super) fn set_pipeline_state(&mut self, state: &PassState) {
        let values = self.dynamic.values_for_pipeline(state);
        if values != DynamicValues::default() {
            self.set_values(&values);
        }
    }

    fn set_values(&self, values: &DynamicValues) {
        let (device, raw) = (&self.cmd.shared.gpu.device, self.cmd.raw());
        // SAFETY: the command buffer is being recorded, and the device has each state: those of depth are core, and what
        // needs a feature was refused without it.
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

/// For pipelines in passes whose depth target is read-only.
pub(super) const READ_ONLY_DEPTH_ERROR: &str =
    "it writes depth or stencil, but the depth target of the pass is read-only; turn the writes off";

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::resource::sampler::CompareOp;

    fn state() -> impl Strategy<Value = PassState> {
        let depth = prop::option::of(any::<bool>());
        let bias = prop::option::of(0..2_u8);
        let rate = prop::option::of(0..2_u32);
        let flags = (any::<bool>(), any::<bool>());
        (depth, bias, flags, rate).prop_map(|(depth, bias, (stencil, blend_constants), rate)| PassState {
            shading_rate: rate.map(|exponent| ShadingRate::new([1 << exponent, 1])),
            depth: depth.map(|write| DepthState { compare: CompareOp::Less, write }),
            bias: bias.map(|constant| DepthBias { constant: constant.into(), ..Default::default() }),
            stencil,
            blend_constants,
        })
    }

    proptest! {
        /// Against a command buffer that forgets each value that a pipeline has of its own.
        #[test]
        fn every_pipeline_finds_what_it_leaves_to_the_pass(
            binds in prop::collection::vec((state(), 0..3_u8), 1..12)
        ) {
            let (mut found, mut vulkan) = (DynamicState::default(), DynamicValues::default());
            for (state, reference) in binds {
                found.stencil_reference = [reference; 2];
                let set = found.values_for_pipeline(&state);
                vulkan.depth = set.depth.or(vulkan.depth.filter(|_| state.depth.is_some()));
                vulkan.bias = set.bias.or(vulkan.bias.filter(|_| state.bias.is_some()));
                vulkan.stencil_reference =
                    set.stencil_reference.or(vulkan.stencil_reference.filter(|_| state.stencil));
                vulkan.blend_constants =
                    set.blend_constants.or(vulkan.blend_constants.filter(|_| state.blend_constants));
                vulkan.shading_rate =
                    set.shading_rate.or(vulkan.shading_rate.filter(|_| state.shading_rate.is_some()));
                prop_assert_eq!(vulkan.shading_rate, state.shading_rate);
                prop_assert_eq!(vulkan.depth, state.depth);
                prop_assert_eq!(vulkan.bias, state.bias);
                prop_assert_eq!(vulkan.stencil_reference, state.stencil.then_some([reference; 2]));
                prop_assert_eq!(vulkan.blend_constants, state.blend_constants.then_some([0.0; 4]));
            }
        }
    }

    #[test]
    fn what_is_held_is_not_set_again() {
        let mut dynamic = DynamicState::default();
        let state = PassState { stencil: true, blend_constants: true, ..Default::default() };
        assert_ne!(dynamic.values_for_pipeline(&state), DynamicValues::default());
        assert_eq!(dynamic.values_for_pipeline(&state), DynamicValues::default());
        dynamic.values_for_pipeline(&PassState::default());
        assert_ne!(dynamic.values_for_pipeline(&state), DynamicValues::default());
    }
}
