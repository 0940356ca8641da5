//! Dynamic state of a render pass, as plain values.

use crate::gpu::caps::shading_rate::ShadingRate;
use crate::pipeline::PassState;
use crate::pipeline::depth_stencil::DepthState;
use crate::pipeline::rasterization::DepthBias;

/// The dynamic state that the pass requests, and the state that the Vulkan command buffer holds.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct DynamicState {
    pub(super) stencil_reference: [u8; 2],
    pub(super) blend_constants: [f32; 4],
    pub(super) current: DynamicValues,
}

/// Values of each dynamic state; `None` for one that is not to be set, or not known.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct DynamicValues {
    pub(super) depth: Option<DepthState>,
    pub(super) bias: Option<DepthBias>,
    pub(super) stencil_reference: Option<[u8; 2]>,
    pub(super) blend_constants: Option<[f32; 4]>,
    pub(super) shading_rate: Option<ShadingRate>,
}

impl DynamicState {
    /// True if draws write depth in the current state.
    pub(super) fn writes_depth(&self) -> bool {
        self.current.depth.is_some_and(|state| state.write)
    }

    /// Returns the values to set for a pipeline with the dynamic state `state`. Binding the pipeline makes all other
    /// state static, and Vulkan loses its dynamic values.
    pub(super) fn values_for_pipeline(&mut self, state: &PassState) -> DynamicValues {
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

/// Returns the wanted value if it differs from the held one.
fn if_changed<T: PartialEq>(wanted: Option<T>, held: Option<T>) -> Option<T> {
    if wanted == held { None } else { wanted }
}

/// The error for pipelines that write in passes whose depth target is read-only.
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
        /// Compares with a command buffer that loses each value that is static in a bound pipeline.
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
    fn current_state_is_not_set_again() {
        let mut dynamic = DynamicState::default();
        let state = PassState { stencil: true, blend_constants: true, ..Default::default() };
        assert_ne!(dynamic.values_for_pipeline(&state), DynamicValues::default());
        assert_eq!(dynamic.values_for_pipeline(&state), DynamicValues::default());
        dynamic.values_for_pipeline(&PassState::default());
        assert_ne!(dynamic.values_for_pipeline(&state), DynamicValues::default());
    }
}
