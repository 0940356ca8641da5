//! Graphics pipelines that are linked from parts, which pipelines share (`VK_EXT_graphics_pipeline_library`).

use std::sync::{Arc, Weak};

use ash::vk;

use super::graphics_create::create_pipeline;
use super::graphics_desc::RenderPipelineDesc;
use super::local_read::inputs_read;
use super::owned_desc::OwnedRenderDesc;
use super::pipeline_layout::PipelineBase;
use super::pipeline_part::Part;
use super::render_modules::RenderModules;
use super::stage::SpecializationConstant;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::caps::optional_features::OptionalFeature;
use crate::lock_order::{Mutex, Rank};

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
        let linked = made
            .map_err(|(_, result)| Error::vulkan("vkCreateGraphicsPipelines", desc.debug_name)(result))?[0];
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
        let reduced = part.reduce(desc, &constants);
        if let Some(found) = self.find(part, &reduced) {
            return Ok(found);
        }
        let mut library = vk::GraphicsPipelineLibraryCreateInfoEXT::default().flags(part.raw());
        // An error names the pipeline; in tools the part has a name of its own, as other pipelines may share it.
        let of_pipeline = RenderPipelineDesc { debug_name: desc.debug_name, ..reduced };
        let raw = create_pipeline(gpu, base, &of_pipeline, &modules, Some(&mut library))?;
        gpu.name(raw, reduced.debug_name);
        let made = Arc::new(PipelinePart { raw, gpu: Arc::clone(gpu) });
        let known = KnownPart { part, desc: OwnedRenderDesc::new(&reduced), compiled: Arc::downgrade(&made) };
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
