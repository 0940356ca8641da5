//! The parts of a graphics pipeline, and what each depends on.

use ash::vk;

use super::depth_stencil::DepthTest;
use super::graphics_desc::RenderPipelineDesc;
use super::rasterization::{DepthBias, Topology};
use super::stage::SpecializationConstant;
use crate::resource::sampler::CompareOp;

/// A part of a graphics pipeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    /// Vertex buffers and topology. Pipelines with mesh shaders have no such part.
    VertexInput,
    /// Shaders before rasterisation, and rasterisation.
    PreRaster,
    /// The fragment shader, depth and stencil tests.
    Fragment,
    /// Targets, blending and samples.
    Output,
}

impl Part {
    pub(super) const ALL: [Self; 4] = [Self::VertexInput, Self::PreRaster, Self::Fragment, Self::Output];

    pub(super) fn raw(self) -> vk::GraphicsPipelineLibraryFlagsEXT {
        match self {
            Self::VertexInput => vk::GraphicsPipelineLibraryFlagsEXT::VERTEX_INPUT_INTERFACE,
            Self::PreRaster => vk::GraphicsPipelineLibraryFlagsEXT::PRE_RASTERIZATION_SHADERS,
            Self::Fragment => vk::GraphicsPipelineLibraryFlagsEXT::FRAGMENT_SHADER,
            Self::Output => vk::GraphicsPipelineLibraryFlagsEXT::FRAGMENT_OUTPUT_INTERFACE,
        }
    }

    /// Returns the members of a description that the part depends on, with defaults for all others. The part is created
    /// from the result, so it can depend on nothing else. Values that are dynamic state have one value.
    pub(super) fn reduce<'a>(
        self,
        desc: &RenderPipelineDesc<'a>,
        specialization: &'a [SpecializationConstant],
    ) -> RenderPipelineDesc<'a> {
        let any_depth = |depth: DepthTest| DepthTest { compare: CompareOp::Always, write: false, ..depth };
        let none = RenderPipelineDesc { debug_name: "part of pipelines", ..Default::default() };
        match self {
            Self::VertexInput => RenderPipelineDesc {
                topology: desc.topology,
                vertex_bindings: desc.vertex_bindings,
                vertex_attributes: desc.vertex_attributes,
                ..none
            },
            Self::PreRaster => RenderPipelineDesc {
                vertex: desc.vertex,
                task: desc.task,
                mesh: desc.mesh,
                tess_control: desc.tess_control,
                tess_eval: desc.tess_eval,
                geometry: desc.geometry,
                topology: match desc.topology {
                    topology @ Topology::Patches { .. } => topology,
                    _ => none.topology,
                },
                cull: desc.cull,
                front_face: desc.front_face,
                polygon: desc.polygon,
                line_width: desc.line_width,
                depth_bias: desc.depth_bias.map(|_| DepthBias::default()),
                depth_clamp: desc.depth_clamp,
                view_mask: desc.view_mask,
                specialization,
                ..none
            },
            Self::Fragment => RenderPipelineDesc {
                fragment: desc.fragment,
                depth: desc.depth.map(any_depth),
                stencil: desc.stencil,
                samples: desc.samples,
                alpha_to_coverage: desc.alpha_to_coverage,
                sample_shading: desc.sample_shading,
                view_mask: desc.view_mask,
                specialization,
                ..none
            },
            Self::Output => RenderPipelineDesc {
                color: desc.color,
                depth: desc.depth.map(any_depth),
                samples: desc.samples,
                alpha_to_coverage: desc.alpha_to_coverage,
                sample_shading: desc.sample_shading,
                view_mask: desc.view_mask,
                ..none
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::Format;
    use crate::pipeline::blend::Blend;
    use crate::pipeline::graphics_desc::{ColorTarget, VertexBinding};
    use crate::pipeline::rasterization::CullMode;

    /// The parts that two descriptions do not share.
    fn differing(first: &RenderPipelineDesc<'_>, second: &RenderPipelineDesc<'_>) -> Vec<Part> {
        Part::ALL.into_iter().filter(|part| part.reduce(first, &[]) != part.reduce(second, &[])).collect()
    }

    #[test]
    fn a_change_of_state_changes_its_own_part() {
        let color = [ColorTarget::new(Format::Rgba8Unorm)];
        let blended = [ColorTarget::blended(Format::Rgba8Unorm, Blend::ALPHA)];
        let depth = DepthTest { format: Format::D32Float, compare: CompareOp::Less, write: true };
        let bindings = [VertexBinding { stride: 12, per_instance: false }];
        let base = RenderPipelineDesc { color: &color, ..Default::default() };
        for (other, parts) in [
            (RenderPipelineDesc { debug_name: "another", ..base }, &[][..]),
            (RenderPipelineDesc { vertex_bindings: &bindings, ..base }, &[Part::VertexInput]),
            (RenderPipelineDesc { topology: Topology::Lines, ..base }, &[Part::VertexInput]),
            (RenderPipelineDesc { cull: CullMode::Back, ..base }, &[Part::PreRaster]),
            (RenderPipelineDesc { depth_bias: Some(DepthBias::default()), ..base }, &[Part::PreRaster]),
            (RenderPipelineDesc { color: &blended, ..base }, &[Part::Output]),
            (RenderPipelineDesc { depth: Some(depth), ..base }, &[Part::Fragment, Part::Output]),
            (RenderPipelineDesc { samples: 4, ..base }, &[Part::Fragment, Part::Output]),
            (RenderPipelineDesc { view_mask: 3, ..base }, &[Part::PreRaster, Part::Fragment, Part::Output]),
            (
                RenderPipelineDesc { topology: Topology::Patches { points: 3 }, ..base },
                &[Part::VertexInput, Part::PreRaster],
            ),
        ] {
            assert_eq!(differing(&base, &other), parts, "{other:?}");
        }
    }

    #[test]
    fn dynamic_state_is_no_part() {
        let depth = DepthTest { format: Format::D32Float, compare: CompareOp::Less, write: true };
        let bias = DepthBias { constant: 2.0, ..Default::default() };
        let first = RenderPipelineDesc { depth: Some(depth), depth_bias: Some(bias), ..Default::default() };
        let depth = DepthTest { compare: CompareOp::Greater, write: false, ..depth };
        let second =
            RenderPipelineDesc { depth: Some(depth), depth_bias: Some(DepthBias::default()), ..first };
        assert_eq!(differing(&first, &second), []);
    }
}
