//! Checks of the fixed state of a graphics pipeline: rasterization, stencil and blending against each other and the
//! device.

use ash::vk;
use spirv::Capability;

use super::graphics_desc::RenderPipelineDesc;
use super::portability::needs;
use super::rasterization::PolygonMode;
use super::render_modules::RenderModules;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::caps::optional_features::OptionalFeature;
use crate::shader::ShaderStage;

/// Fails unless the device supports the fixed state.
pub(super) fn check_state(gpu: &Gpu, desc: &RenderPipelineDesc<'_>, modules: &RenderModules) -> Result<()> {
    check_raster(gpu, desc)?;
    check_portability(gpu, desc, modules)?;
    check_samples(gpu, desc)?;
    check_stencil(desc)?;
    check_views(gpu, desc, modules)?;
    check_rates(gpu, desc, modules)?;
    check_dual_source_blend(gpu, desc, modules)
}

fn check_raster(gpu: &Gpu, desc: &RenderPipelineDesc<'_>) -> Result<()> {
    let name = desc.debug_name;
    let require = |wanted: bool, feature: OptionalFeature, what: &str| {
        if wanted { gpu.require(feature, &format!("{what} in pipeline '{name}'")) } else { Ok(()) }
    };
    let outlines = desc.polygon != PolygonMode::Fill;
    require(outlines, OptionalFeature::FillModeNonSolid, "a polygon mode beside Fill")?;
    require(desc.depth_clamp, OptionalFeature::DepthClamp, "depth clamp")?;
    check_line_width(gpu, desc)?;
    let Some(bias) = desc.depth_bias else { return Ok(()) };
    if !bias.is_finite() {
        return Err(Error::usage(name, format!("{bias:?} has parts that are no finite numbers")));
    }
    require(bias.clamp != 0.0, OptionalFeature::DepthBiasClamp, "a depth bias with a bound")
}

/// Fails if the state needs a feature that devices with `VK_KHR_portability_subset` may lack, and this one does.
fn check_portability(gpu: &Gpu, desc: &RenderPipelineDesc<'_>, modules: &RenderModules) -> Result<()> {
    let tessellated = modules.tess_eval.as_ref().and_then(|eval| eval.reflection.primitive);
    gpu.require_portable(&format!("pipeline '{}'", desc.debug_name), needs(desc, tessellated))
}

fn check_line_width(gpu: &Gpu, desc: &RenderPipelineDesc<'_>) -> Result<()> {
    let (name, width) = (desc.debug_name, desc.line_width);
    if width.to_bits() == 1.0_f32.to_bits() {
        return Ok(());
    }
    gpu.require(OptionalFeature::WideLines, &format!("lines {width} pixels wide in pipeline '{name}'"))?;
    let [least, most] = gpu.caps.limits.line_width;
    if (least..=most).contains(&width) {
        return Ok(());
    }
    Err(Error::usage(name, format!("lines are {least} to {most} pixels wide, not {width}")))
}

/// Fails unless all targets support the sample count. For a pipeline without targets, the device's sample counts of
/// passes without attachments apply.
fn check_samples(gpu: &Gpu, desc: &RenderPipelineDesc<'_>) -> Result<()> {
    let (name, samples) = (desc.debug_name, desc.samples);
    if !samples.is_power_of_two() || samples > 64 {
        return Err(Error::usage(name, format!("samples are 1, 2, 4, 8, 16, 32 or 64, not {samples}")));
    }
    let color = desc.color.iter().map(|target| (target.format, vk::ImageUsageFlags::COLOR_ATTACHMENT));
    let depth = desc.depth.map(|depth| (depth.format, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT));
    for (format, usage) in color.chain(depth) {
        let most = gpu.target_samples(format.raw(), usage, name)?;
        if samples > 1 && !most.contains(vk::SampleCountFlags::from_raw(samples)) {
            let what = format!("{samples} samples a pixel of {format:?} in pipeline '{name}'");
            return Err(Error::unsupported(what, format!("the device has {most:?}")));
        }
    }
    if !(0.0..=1.0).contains(&desc.sample_shading) {
        let message = format!("sample_shading is a fraction from 0 to 1, not {}", desc.sample_shading);
        return Err(Error::usage(name, message));
    }
    if desc.sample_shading > 0.0 {
        gpu.require(OptionalFeature::SampleRateShading, &format!("sample shading in pipeline '{name}'"))?;
    }
    Ok(())
}

fn check_stencil(desc: &RenderPipelineDesc<'_>) -> Result<()> {
    let holds = desc.depth.is_some_and(|depth| depth.format.has_stencil());
    if desc.stencil.is_none() || holds {
        return Ok(());
    }
    let message = "a stencil test needs a depth test whose format holds stencil, D32FloatS8 or D24UnormS8; one that \
                   always passes and writes nothing will do";
    Err(Error::usage(desc.debug_name, message))
}

/// Fails unless the stages support the view mask. Stages before rasterisation need features of their own for several
/// views, and may not write the layer.
fn check_views(gpu: &Gpu, desc: &RenderPipelineDesc<'_>, modules: &RenderModules) -> Result<()> {
    if desc.view_mask == 0 {
        return Ok(());
    }
    let name = desc.debug_name;
    gpu.check_view_mask(name, desc.view_mask)?;
    for (stage, feature, what) in [
        (&modules.tess_eval, OptionalFeature::MultiviewTessellation, "tessellation"),
        (&modules.geometry, OptionalFeature::MultiviewGeometry, "the geometry stage"),
        (&modules.mesh, OptionalFeature::MultiviewMesh, "the mesh stage"),
    ] {
        if stage.is_some() {
            gpu.require(feature, &format!("{what} of pipeline '{name}' with a view mask"))?;
        }
    }
    match modules.iter().find(|module| module.reflection.writes_layer) {
        None => Ok(()),
        Some(module) => {
            let message =
                format!("'{}' writes gl_Layer, but with a view mask the view decides the layer", module.name);
            Err(Error::usage(name, message))
        }
    }
}

/// Fails unless the device supports the shading rates. Rates per primitive, written before rasterisation, need a
/// feature of their own.
fn check_rates(gpu: &Gpu, desc: &RenderPipelineDesc<'_>, modules: &RenderModules) -> Result<()> {
    let name = desc.debug_name;
    for module in modules.iter().filter(|module| module.stage != ShaderStage::Fragment) {
        let capability = Capability::FragmentShadingRateKHR as u32;
        if module.reflection.capabilities.contains(&capability) {
            let feature = match module.stage {
                ShaderStage::Mesh => OptionalFeature::MeshPrimitiveShadingRate,
                _ => OptionalFeature::PrimitiveShadingRate,
            };
            gpu.require(feature, &format!("gl_PrimitiveShadingRateEXT in '{}' of '{name}'", module.name))?;
        }
    }
    desc.shading_rate.map_or(Ok(()), |rate| gpu.check_shading_rate(name, &rate, desc.samples))
}

/// Fails unless dual source blending is possible: it takes exactly one target, and the fragment shader must write the
/// second source.
fn check_dual_source_blend(gpu: &Gpu, desc: &RenderPipelineDesc<'_>, modules: &RenderModules) -> Result<()> {
    let name = desc.debug_name;
    if !desc.color.iter().filter_map(|target| target.blend).any(|blend| blend.is_dual_source()) {
        return Ok(());
    }
    gpu.require(OptionalFeature::DualSourceBlend, &format!("a second blend source in pipeline '{name}'"))?;
    if desc.color.len() > 1 {
        return Err(Error::usage(name, "a second blend source allows one colour target only; draw to one"));
    }
    match &modules.fragment {
        Some(fragment) if fragment.reflection.second_output => Ok(()),
        _ => {
            let message = "a blend factor takes the second source, but the fragment shader has no output with \
                           layout(location = 0, index = 1)";
            Err(Error::usage(name, message))
        }
    }
}
