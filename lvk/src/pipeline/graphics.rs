//! Graphics pipelines, created in small steps.

use std::sync::Arc;

use ash::vk;

use super::blend::ColorWriteMask;
use super::graphics_check::{check_modules, check_stages};
use super::graphics_create::create_pipeline;
use super::graphics_desc::{ColorTarget, RenderPipelineDesc};
use super::graphics_parts::{GraphicsParts, PipelinePart, is_linked_from_parts};
use super::local_read::{inputs_read, inputs_written, writes_color};
use super::pass_state::PassState;
use super::pipeline_layout::PipelineBase;
use super::render_modules::RenderModules;
use super::rendering_formats::RenderingFormats;
use super::shader_module::ModuleLookup;
use super::stage::Specialization;
use crate::barrier::Stages;
use crate::bindless::input_attachments::InputAttachmentMask;
use crate::cpu_scope::cpu_scope;
use crate::error::Result;
use crate::gpu::Gpu;

/// The source of a pipeline's primitives. It decides which draw commands the pipeline takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FrontEnd {
    /// A vertex shader: draws of vertices.
    Vertex,
    /// A mesh shader: draws of mesh workgroups.
    Mesh,
    /// A task shader and a mesh shader: draws of task workgroups.
    TaskAndMesh,
}

/// A graphics pipeline, destroyed on drop.
pub(crate) struct RenderPipeline {
    pub(crate) raw: vk::Pipeline,
    pub(crate) push_constant_bytes: u32,
    /// Stages that run ray queries.
    pub(crate) query_stages: Stages,
    pub(crate) front_end: FrontEnd,
    pub(crate) shape: RenderingFormats,
    pub(crate) pass_state: PassState,
    /// True if draws may change stencil values.
    pub(crate) writes_stencil: bool,
    pub(crate) vertex_binding_count: u32,
    /// Targets that the fragment shader reads.
    pub(crate) reads: InputAttachmentMask,
    /// Targets that draws may change.
    pub(crate) writes: InputAttachmentMask,
    pub(crate) name: Arc<str>,
    /// Parts that the pipeline is linked from; empty if it was compiled as a whole.
    _parts: Vec<Arc<PipelinePart>>,
    gpu: Arc<Gpu>,
}

impl RenderPipeline {
    pub(crate) fn new(
        gpu: &Arc<Gpu>,
        base: PipelineBase,
        desc: &RenderPipelineDesc<'_>,
        find: ModuleLookup<'_>,
        parts: &GraphicsParts,
    ) -> Result<Self> {
        cpu_scope!("create graphics pipeline");
        check_stages(gpu, desc)?;
        let modules = RenderModules::resolve(desc, find)?;
        check_modules(gpu, desc, &modules)?;
        // A constant that no module declares is an error of the whole pipeline.
        Specialization::new(desc.debug_name, desc.specialization, modules.iter())?;
        let written = written_targets(desc, &modules);
        let plan = RenderPipelineDesc { color: &written, ..*desc };
        let (raw, parts) = if is_linked_from_parts(gpu, desc, &modules) {
            parts.link(gpu, base, &plan, &modules)?
        } else {
            (create_pipeline(gpu, base, &plan, &modules, None)?, Vec::new())
        };
        gpu.name(raw, desc.debug_name);
        let push_constant_bytes = modules.iter().map(|m| m.reflection.push_constant_bytes).max();
        Ok(Self {
            raw,
            push_constant_bytes: push_constant_bytes.unwrap_or(0),
            query_stages: modules.query_stages(),
            front_end: match (&modules.mesh, &modules.task) {
                (None, _) => FrontEnd::Vertex,
                (Some(_), None) => FrontEnd::Mesh,
                (Some(_), Some(_)) => FrontEnd::TaskAndMesh,
            },
            shape: desc.rendering_formats(),
            pass_state: PassState::from_desc(desc),
            writes_stencil: desc.stencil.is_some_and(|test| test.writes()),
            vertex_binding_count: desc.vertex_bindings.len() as u32,
            reads: inputs_read(&modules),
            writes: inputs_written(desc, &modules),
            name: desc.debug_name.into(),
            _parts: parts,
            gpu: Arc::clone(gpu),
        })
    }
}

impl Drop for RenderPipeline {
    fn drop(&mut self) {
        // SAFETY: the owner has waited until the GPU is done with the pipeline.
        unsafe { self.gpu.device.destroy_pipeline(self.raw, None) };
    }
}

/// Returns the targets. One without an output of the fragment shader is not written.
fn written_targets(desc: &RenderPipelineDesc<'_>, modules: &RenderModules) -> Vec<ColorTarget> {
    let write = |place, target: &ColorTarget| {
        if writes_color(modules, place, target) { target.write } else { ColorWriteMask::empty() }
    };
    let targets = (0..).zip(desc.color);
    targets.map(|(place, target)| ColorTarget { write: write(place, target), ..*target }).collect()
}
