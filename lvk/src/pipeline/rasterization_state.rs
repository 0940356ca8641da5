//! Rasterization and multisample state of a graphics pipeline in Vulkan's form.

use ash::vk;

use super::graphics_desc::RenderPipelineDesc;
use super::rasterization::{CullMode, FrontFace, PolygonMode};

/// Returns Vulkan's rasterization state of a pipeline.
pub(super) fn rasterization(
    desc: &RenderPipelineDesc<'_>,
) -> vk::PipelineRasterizationStateCreateInfo<'static> {
    let cull = match desc.cull {
        CullMode::None => vk::CullModeFlags::NONE,
        CullMode::Front => vk::CullModeFlags::FRONT,
        CullMode::Back => vk::CullModeFlags::BACK,
    };
    let front = match desc.front_face {
        FrontFace::CounterClockwise => vk::FrontFace::COUNTER_CLOCKWISE,
        FrontFace::Clockwise => vk::FrontFace::CLOCKWISE,
    };
    let polygon = match desc.polygon {
        PolygonMode::Fill => vk::PolygonMode::FILL,
        PolygonMode::Line => vk::PolygonMode::LINE,
        PolygonMode::Point => vk::PolygonMode::POINT,
    };
    vk::PipelineRasterizationStateCreateInfo::default()
        .cull_mode(cull)
        .front_face(front)
        .polygon_mode(polygon)
        .line_width(desc.line_width)
        .depth_clamp_enable(desc.depth_clamp)
        .depth_bias_enable(desc.depth_bias.is_some())
}

/// Returns Vulkan's multisample state of a pipeline. The value of a `VkSampleCountFlagBits` is its number of samples.
pub(super) fn multisampling(
    desc: &RenderPipelineDesc<'_>,
) -> vk::PipelineMultisampleStateCreateInfo<'static> {
    vk::PipelineMultisampleStateCreateInfo::default()
        .rasterization_samples(vk::SampleCountFlags::from_raw(desc.samples))
        .sample_shading_enable(desc.sample_shading > 0.0)
        .min_sample_shading(desc.sample_shading)
        .alpha_to_coverage_enable(desc.alpha_to_coverage)
}
