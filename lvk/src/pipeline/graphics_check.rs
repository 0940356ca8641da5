//! Checks of a graphics pipeline: stages, targets and vertex input against each other and the device.

use ash::vk;

use super::block_layout::check_layouts;
use super::graphics_desc::{ColorTarget, RenderPipelineDesc};
use super::local_read::check_inputs;
use super::portability::check_strides;
use super::rasterization::Topology;
use super::render_modules::RenderModules;
use super::stage_interface_check::check_interfaces;
use super::state_check::check_state;
use super::workgroup_memory::{WorkgroupMemoryLimits, check_workgroup_memory};
use super::workgroup_size::{WorkgroupLimits, check_workgroup_size};
use crate::error::limit_origin::LimitOrigin;
use crate::error::{Error, Result, check_limit, check_limit_of};
use crate::format::Format;
use crate::gpu::Gpu;
use crate::gpu::caps::mesh_limits::MeshLimits;
use crate::gpu::caps::optional_features::OptionalFeature;
use crate::shader::{Primitive, ShaderStage};

/// Fails unless the stages of the description can be combined.
pub(super) fn check_stages(gpu: &Gpu, desc: &RenderPipelineDesc<'_>) -> Result<()> {
    let name = desc.debug_name;
    let message = match (desc.vertex, desc.task, desc.mesh) {
        (None, _, None) if desc.task.is_some() => "a task shader needs a mesh shader behind it",
        (None, _, None) => "give the pipeline a vertex shader or a mesh shader",
        (Some(_), _, Some(_)) => "a mesh shader takes the place of the vertex shader; give one of them",
        (Some(_), Some(_), None) => "a task shader feeds a mesh shader, not a vertex shader",
        (None, _, Some(_))
            if desc.tess_control.or(desc.tess_eval).or(desc.geometry).is_some()
                || desc.topology.patch_points() > 0 =>
        {
            "a mesh shader makes its primitives itself; leave tessellation, geometry and patches out"
        }
        _ if desc.tess_control.is_some() != desc.tess_eval.is_some() => {
            "tessellation takes a control and an evaluation shader; give the pipeline both"
        }
        _ if desc.tess_eval.is_some() != matches!(desc.topology, Topology::Patches { .. }) => {
            "tessellation shaders and Topology::Patches need each other"
        }
        (None, _, Some(_)) if !desc.vertex_bindings.is_empty() || !desc.vertex_attributes.is_empty() => {
            "a mesh shader has no vertex buffers and attributes; let it read by address"
        }
        _ => {
            let lacking = desc.mesh.is_some() && !gpu.caps.mesh_shader;
            return if lacking {
                Err(gpu.unsupported(&format!("mesh shaders, of which pipeline '{name}' has one")))
            } else {
                check_optional_stages(gpu, desc)
            };
        }
    };
    Err(Error::usage(name, message))
}

fn check_optional_stages(gpu: &Gpu, desc: &RenderPipelineDesc<'_>) -> Result<()> {
    let name = desc.debug_name;
    if let Topology::Patches { points } = desc.topology {
        gpu.require(OptionalFeature::TessellationShader, &format!("tessellation in pipeline '{name}'"))?;
        if points == 0 {
            return Err(Error::usage(name, "patches have at least one point"));
        }
        let most = gpu.caps.limits.max_patch_points;
        check_limit(name, "count of points of a patch", points.into(), most.into())?;
    }
    match desc.geometry {
        Some(_) => gpu.require(OptionalFeature::GeometryShader, &format!("the geometry stage of '{name}'")),
        None => Ok(()),
    }
}

/// Fails unless each module has the right stage and the pipeline is within the limits of the device.
pub(super) fn check_modules(gpu: &Gpu, desc: &RenderPipelineDesc<'_>, modules: &RenderModules) -> Result<()> {
    let name = desc.debug_name;
    let stages = [
        (&modules.vertex, ShaderStage::Vertex),
        (&modules.task, ShaderStage::Task),
        (&modules.mesh, ShaderStage::Mesh),
        (&modules.tess_control, ShaderStage::TessControl),
        (&modules.tess_eval, ShaderStage::TessEval),
        (&modules.geometry, ShaderStage::Geometry),
        (&modules.fragment, ShaderStage::Fragment),
    ];
    for (module, stage) in stages {
        module.as_ref().map_or(Ok(()), |module| module.check_stage(stage))?;
    }
    check_layouts(name, desc.layouts, modules.iter())?;
    check_interfaces(name, modules)?;
    let targets = desc.color.len() as u64;
    check_limit(name, "colour target count", targets, gpu.caps.limits.max_color_targets.into())?;
    desc.color.iter().try_for_each(|target| check_color(gpu, name, target))?;
    desc.depth.map_or(Ok(()), |depth| check_depth(gpu, name, depth.format))?;
    check_state(gpu, desc, modules)?;
    check_mesh(gpu, desc, modules)?;
    check_geometry(desc, modules)?;
    check_inputs(desc, modules)?;
    check_vertex_input(name, desc)?;
    check_vertex_formats(gpu, desc)?;
    let alignment = gpu.caps.limits.vertex_stride_alignment;
    if gpu.caps.portability_subset || alignment > 1 {
        check_strides(name, desc.vertex_bindings, alignment)?;
    }
    match &modules.vertex {
        Some(vertex) => check_locations(name, desc, &vertex.reflection.inputs),
        None => Ok(()),
    }
}

fn check_color(gpu: &Gpu, name: &str, target: &ColorTarget) -> Result<()> {
    let features = gpu.format_features(target.format);
    if !target.format.is_color() || !features.contains(vk::FormatFeatureFlags::COLOR_ATTACHMENT) {
        let what = format!("{:?} as a colour target of '{name}'", target.format);
        return Err(Error::unsupported(what, "the device cannot draw to it; choose another format"));
    }
    if target.blend.is_some() && !features.contains(vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND) {
        let what = format!("blending into {:?} in '{name}'", target.format);
        return Err(Error::unsupported(what, "the device cannot blend this format"));
    }
    Ok(())
}

fn check_depth(gpu: &Gpu, name: &str, format: Format) -> Result<()> {
    let features = gpu.format_features(format);
    if features.contains(vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT) {
        return Ok(());
    }
    let what = format!("{format:?} as the depth target of '{name}'");
    Err(Error::unsupported(what, "choose D32Float or D16Unorm"))
}

fn check_mesh(gpu: &Gpu, desc: &RenderPipelineDesc<'_>, modules: &RenderModules) -> Result<()> {
    let (name, limits) = (desc.debug_name, &gpu.caps.limits.mesh);
    if let Some(task) = &modules.task {
        let most = WorkgroupLimits {
            size: limits.max_task_workgroup_size,
            invocations: limits.max_task_invocations,
        };
        check_workgroup_size(name, task, desc.specialization, &most)?;
        check_workgroup_memory(name, task, desc.specialization, &task_memory(limits))?;
    }
    let Some(mesh) = &modules.mesh else { return Ok(()) };
    let most =
        WorkgroupLimits { size: limits.max_mesh_workgroup_size, invocations: limits.max_mesh_invocations };
    check_workgroup_size(name, mesh, desc.specialization, &most)?;
    check_workgroup_memory(name, mesh, desc.specialization, &mesh_memory(limits))?;
    let [vertices, primitives] = mesh.reflection.mesh_outputs;
    let most = limits.max_output_vertices;
    check_limit(name, "count of vertices of a mesh workgroup", vertices.into(), most.into())?;
    let most = limits.max_output_primitives;
    check_limit(name, "count of primitives of a mesh workgroup", primitives.into(), most.into())
}

fn task_memory(limits: &MeshLimits) -> WorkgroupMemoryLimits {
    WorkgroupMemoryLimits {
        shared: limits.max_task_shared_bytes,
        payload: limits.max_task_payload_bytes,
        together: limits.max_task_payload_and_shared_bytes,
    }
}

/// Returns the memory limits of a mesh workgroup, which also holds the payload of its task workgroup.
fn mesh_memory(limits: &MeshLimits) -> WorkgroupMemoryLimits {
    WorkgroupMemoryLimits {
        shared: limits.max_mesh_shared_bytes,
        payload: limits.max_task_payload_bytes,
        together: limits.max_mesh_payload_and_shared_bytes,
    }
}

/// Fails unless the geometry shader takes the primitives of the stage before it.
fn check_geometry(desc: &RenderPipelineDesc<'_>, modules: &RenderModules) -> Result<()> {
    let Some(geometry) = &modules.geometry else { return Ok(()) };
    let of_patches = || modules.tess_eval.as_ref().and_then(|eval| eval.reflection.primitive);
    let (Some(given), Some(taken)) =
        (desc.topology.primitive().or_else(of_patches), geometry.reflection.primitive)
    else {
        return Ok(());
    };
    if given == taken {
        return Ok(());
    }
    let message = if taken == Primitive::Adjacent {
        format!("the geometry shader '{}' takes adjacent vertices, which no topology has", geometry.name)
    } else {
        format!("the geometry shader '{}' takes {taken:?}, but {given:?} come to it", geometry.name)
    };
    Err(Error::usage(desc.debug_name, message))
}

/// Fails unless each location that the vertex shader reads has exactly one attribute.
fn check_locations(name: &str, desc: &RenderPipelineDesc<'_>, inputs: &[u32]) -> Result<()> {
    let mut given: Vec<u32> = desc.vertex_attributes.iter().map(|attribute| attribute.location).collect();
    given.sort_unstable();
    if let Some(pair) = given.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(Error::usage(name, format!("two vertex attributes have the location {}", pair[0])));
    }
    match inputs.iter().find(|location| !given.contains(location)) {
        None => Ok(()),
        Some(location) => {
            let message =
                format!("the vertex shader reads location {location}, which no vertex attribute has");
            Err(Error::usage(name, message))
        }
    }
}

/// Fails unless the device can fetch each format at the offset and stride of its attribute.
fn check_vertex_formats(gpu: &Gpu, desc: &RenderPipelineDesc<'_>) -> Result<()> {
    for attribute in desc.vertex_attributes {
        let (format, unit) = (attribute.format, attribute.format.component_bytes());
        if !gpu.buffer_features(format.raw()).contains(vk::FormatFeatureFlags::VERTEX_BUFFER) {
            let what = format!("vertex format {format:?} in pipeline '{}'", desc.debug_name);
            return Err(Error::unsupported(what, "the device cannot fetch it; choose another format"));
        }
        let stride = desc.vertex_bindings.get(attribute.binding as usize).map_or(0, |binding| binding.stride);
        if !stride.is_multiple_of(unit) || !attribute.offset.is_multiple_of(unit) {
            let message = format!(
                "vertex attribute {} has the offset {} and the stride {stride}; {format:?} needs multiples of {unit} bytes",
                attribute.location, attribute.offset
            );
            return Err(Error::usage(desc.debug_name, message));
        }
    }
    Ok(())
}

fn check_vertex_input(name: &str, desc: &RenderPipelineDesc<'_>) -> Result<()> {
    const MAX: u64 = 16;
    check_limit_of(
        LimitOrigin::Library,
        name,
        "vertex binding count",
        desc.vertex_bindings.len() as u64,
        MAX,
    )?;
    check_limit_of(
        LimitOrigin::Library,
        name,
        "vertex attribute count",
        desc.vertex_attributes.len() as u64,
        MAX,
    )?;
    for attribute in desc.vertex_attributes {
        let Some(binding) = desc.vertex_bindings.get(attribute.binding as usize) else {
            let message =
                format!("vertex attribute {} names binding {}", attribute.location, attribute.binding);
            return Err(Error::usage(name, format!("{message}, which does not exist")));
        };
        let end = u64::from(attribute.offset) + u64::from(attribute.format.size_bytes());
        if end > u64::from(binding.stride) {
            let message = format!("vertex attribute {} ends beyond the stride", attribute.location);
            return Err(Error::usage(name, message));
        }
        check_limit_of(
            LimitOrigin::Library,
            name,
            "vertex attribute location",
            attribute.location.into(),
            MAX - 1,
        )?;
    }
    desc.vertex_bindings.iter().try_for_each(|binding| {
        check_limit_of(LimitOrigin::Library, name, "vertex stride in bytes", binding.stride.into(), 2048)
    })
}
