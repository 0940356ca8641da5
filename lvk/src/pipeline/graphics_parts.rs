//! Graphics pipelines that are linked from parts, which pipelines share (`VK_EXT_graphics_pipeline_library`).

use std::sync::{Arc, Weak};

use ash::vk;

use super::depth_stencil::DepthTest;
use super::graphics::create_pipeline;
use super::graphics_desc::RenderPipelineDesc;
use super::local_read::inputs_read;
use super::owned_desc::OwnedRenderDesc;
use super::pipeline_layout::PipelineBase;
use super::rasterization::{DepthBias, Topology};
use super::render_modules::RenderModules;
use super::stage::SpecializationConstant;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::caps::optional_features::OptionalFeature;
use crate::lock_order::{Mutex, Rank};
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
    const ALL: [Self; 4] = [Self::VertexInput, Self::PreRaster, Self::Fragment, Self::Output];

    fn raw(self) -> vk::GraphicsPipelineLibraryFlagsEXT {
        match self {
            Self::VertexInput => vk::GraphicsPipelineLibraryFlagsEXT::VERTEX_INPUT_INTERFACE,
            Self::PreRaster => vk::GraphicsPipelineLibraryFlagsEXT::PRE_RASTERIZATION_SHADERS,
            Self::Fragment => vk::GraphicsPipelineLibraryFlagsEXT::FRAGMENT_SHADER,
            Self::Output => vk::GraphicsPipelineLibraryFlagsEXT::FRAGMENT_OUTPUT_INTERFACE,
        }
    }

    /// Returns the members of a description that the part depends on, with defaults for all others. The part is created
    /// from the result, so it can depend on nothing else. Values that are dynamic state have one value.
    fn reduce<'a>(
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

/// A compiled part, destroyed on drop.
pub(crate) struct PipelinePart {
    raw: vk::Pipeline,
    gpu: Arc<Gpu>,
}

impl Drop for PipelinePart {
    fn drop(&mut self) {
        // SAFETY: pipelines that are linked from the part hold it.
        unsafe { self.gpu.device.destroy_pipeline(self.raw, None) };
    }
}

/// The parts of the pipelines of a context. A part lives as long as a pipeline that is linked from it.
pub(crate) struct GraphicsParts {
    known: Mutex<Vec<KnownPart>>,
}

struct KnownPart {
    part: Part,
    desc: OwnedRenderDesc,
    compiled: Weak<PipelinePart>,
}

impl GraphicsParts {
    pub(crate) fn new() -> Self {
        Self { known: Mutex::new(Rank::GraphicsParts, Vec::new()) }
    }

    /// Returns the number of live parts.
    #[cfg(any(test, feature = "test-hooks"))]
    pub(crate) fn count(&self) -> usize {
        self.known.lock().iter().filter(|known| known.compiled.strong_count() > 0).count()
    }

    /// Links a pipeline from its parts. Compiles those that no other pipeline has.
    pub(super) fn link(
        &self,
        gpu: &Arc<Gpu>,
        base: PipelineBase,
        desc: &RenderPipelineDesc<'_>,
        modules: &RenderModules,
    ) -> Result<(vk::Pipeline, Vec<Arc<PipelinePart>>)> {
        let needed =
            Part::ALL.into_iter().filter(|part| *part != Part::VertexInput || modules.mesh.is_none());
        let parts = needed.map(|part| self.compiled(gpu, base, part, desc, modules));
        let parts = parts.collect::<Result<Vec<_>>>()?;
        let raw: Vec<_> = parts.iter().map(|part| part.raw).collect();
        let mut libraries = vk::PipelineLibraryCreateInfoKHR::default().libraries(&raw);
        let info = vk::GraphicsPipelineCreateInfo::default().layout(base.layout).push_next(&mut libraries);
        // SAFETY: the parts are alive, complete each other, and have the same layout, views and samples.
        let made = unsafe { gpu.device.create_graphics_pipelines(base.cache, &[info], None) };
        let linked = made.map_err(|(_, result)| Error::vulkan("vkCreateGraphicsPipelines")(result))?[0];
        Ok((linked, parts))
    }

    fn compiled(
        &self,
        gpu: &Arc<Gpu>,
        base: PipelineBase,
        part: Part,
        desc: &RenderPipelineDesc<'_>,
        modules: &RenderModules,
    ) -> Result<Arc<PipelinePart>> {
        let modules = modules.of_part(part);
        let constants = declared(desc.specialization, &modules);
        let desc = part.reduce(desc, &constants);
        if let Some(found) = self.find(part, &desc) {
            return Ok(found);
        }
        let mut library = vk::GraphicsPipelineLibraryCreateInfoEXT::default().flags(part.raw());
        let raw = create_pipeline(gpu, base, &desc, &modules, Some(&mut library))?;
        gpu.name(raw, desc.debug_name);
        let made = Arc::new(PipelinePart { raw, gpu: Arc::clone(gpu) });
        let known = KnownPart { part, desc: OwnedRenderDesc::new(&desc), compiled: Arc::downgrade(&made) };
        self.known.lock().push(known);
        Ok(made)
    }

    /// Returns the part that was compiled from `desc`. Forgets parts that no pipeline has any more.
    fn find(&self, part: Part, desc: &RenderPipelineDesc<'_>) -> Option<Arc<PipelinePart>> {
        let mut known = self.known.lock();
        known.retain(|known| known.compiled.strong_count() > 0);
        let found = known.iter().find(|known| known.part == part && known.desc.desc() == *desc);
        found.and_then(|known| known.compiled.upgrade())
    }
}

/// True if the pipeline can be linked from parts on the device, and is to be.
pub(super) fn is_linked_from_parts(
    gpu: &Gpu,
    desc: &RenderPipelineDesc<'_>,
    modules: &RenderModules,
) -> bool {
    desc.fast_link
        && gpu.caps.has(OptionalFeature::GraphicsPipelineLibrary)
        && modules.fragment.is_some()
        && desc.shading_rate.is_none()
        && inputs_read(modules).is_empty()
}

/// Returns the constants that a module declares.
fn declared(constants: &[SpecializationConstant], modules: &RenderModules) -> Vec<SpecializationConstant> {
    let is_declared = |constant: &&SpecializationConstant| {
        let mut ids = modules.iter().flat_map(|module| &module.reflection.specialization);
        ids.any(|(id, _)| *id == constant.id)
    };
    constants.iter().filter(is_declared).copied().collect()
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
