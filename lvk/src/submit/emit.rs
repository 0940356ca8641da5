//! Turns barriers the tracker decided into one `vkCmdPipelineBarrier2`.

use std::collections::HashMap;

use ash::vk;

use crate::barrier::{Access, Barriers, ImageBarrier, Layout, MemoryBarrier, ResourceId, Stages};
use crate::gpu::Gpu;
use crate::resource::image::BarrierImage;

/// Images a command buffer touches, by the id the tracker knows them by.
pub(crate) type Images = HashMap<ResourceId, BarrierImage>;

/// Records the barriers, if there are any.
pub(crate) fn emit(gpu: &Gpu, commands: vk::CommandBuffer, barriers: &Barriers, images: &Images) {
    let memory = memory_barriers(gpu, barriers.memory);
    let images: Vec<_> =
        barriers.images.iter().filter_map(|barrier| image_barrier(gpu, barrier, images)).collect();
    if memory.is_empty() && images.is_empty() {
        return;
    }
    let info = vk::DependencyInfo::default().memory_barriers(&memory).image_memory_barriers(&images);
    // SAFETY: the command buffer is being recorded outside of a render pass, and the images are alive.
    unsafe { gpu.device.cmd_pipeline_barrier2(commands, &info) };
}

fn memory_barriers(gpu: &Gpu, barrier: Option<MemoryBarrier>) -> Vec<vk::MemoryBarrier2<'static>> {
    if gpu.caps.hardware_ray_query() {
        return barrier.iter().map(|barrier| memory_barrier(gpu, barrier)).collect();
    }
    let parts = barrier.into_iter().flat_map(MemoryBarrier::without_ray_queries);
    parts.map(|barrier| memory_barrier(gpu, &barrier)).collect()
}

fn memory_barrier(gpu: &Gpu, barrier: &MemoryBarrier) -> vk::MemoryBarrier2<'static> {
    vk::MemoryBarrier2::default()
        .src_stage_mask(stages(gpu, barrier.src_stages))
        .src_access_mask(access(gpu, barrier.src_access))
        .dst_stage_mask(stages(gpu, barrier.dst_stages))
        .dst_access_mask(access(gpu, barrier.dst_access))
}

fn image_barrier(
    gpu: &Gpu,
    barrier: &ImageBarrier,
    images: &Images,
) -> Option<vk::ImageMemoryBarrier2<'static>> {
    let image = images.get(&barrier.id)?;
    let scopes = &barrier.scopes;
    let barrier = vk::ImageMemoryBarrier2::default()
        .src_stage_mask(stages(gpu, scopes.src_stages))
        .src_access_mask(access(gpu, scopes.src_access))
        .dst_stage_mask(stages(gpu, scopes.dst_stages))
        .dst_access_mask(access(gpu, scopes.dst_access))
        .old_layout(layout(scopes.old_layout))
        .new_layout(layout(scopes.new_layout))
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .image(image.raw)
        .subresource_range(image.range(barrier.subresources));
    Some(barrier)
}

/// Stages by their Vulkan names, without those whose feature is off.
fn stages(gpu: &Gpu, stages: Stages) -> vk::PipelineStageFlags2 {
    use vk::PipelineStageFlags2 as Raw;
    let table = [
        (Stages::HOST, Raw::HOST),
        (Stages::TRANSFER, Raw::ALL_TRANSFER),
        (Stages::DRAW_INDIRECT, Raw::DRAW_INDIRECT),
        (Stages::VERTEX_INPUT, Raw::VERTEX_INPUT),
        (Stages::PRE_RASTER, Raw::PRE_RASTERIZATION_SHADERS),
        (Stages::FRAGMENT, Raw::FRAGMENT_SHADER),
        (Stages::DEPTH, Raw::EARLY_FRAGMENT_TESTS | Raw::LATE_FRAGMENT_TESTS),
        (Stages::COLOR, Raw::COLOR_ATTACHMENT_OUTPUT),
        (Stages::COMPUTE, Raw::COMPUTE_SHADER),
        (Stages::RAY_TRACING, if_on(gpu.ray_tracing.is_some(), Raw::RAY_TRACING_SHADER_KHR)),
        (Stages::ACCEL_BUILD, if_on(gpu.accel.is_some(), Raw::ACCELERATION_STRUCTURE_BUILD_KHR)),
    ];
    table.iter().filter(|(bit, _)| stages.contains(*bit)).fold(Raw::NONE, |all, (_, raw)| all | *raw)
}

/// Accesses by their Vulkan names, without those whose feature is off.
fn access(gpu: &Gpu, access: Access) -> vk::AccessFlags2 {
    use vk::AccessFlags2 as Raw;
    let structures = gpu.accel.is_some();
    let table = [
        (Access::INDIRECT_READ, Raw::INDIRECT_COMMAND_READ),
        (Access::INDEX_READ, Raw::INDEX_READ),
        (Access::VERTEX_READ, Raw::VERTEX_ATTRIBUTE_READ),
        (Access::SHADER_READ, Raw::SHADER_READ),
        (Access::SHADER_WRITE, Raw::SHADER_WRITE),
        (Access::COLOR_READ, Raw::COLOR_ATTACHMENT_READ),
        (Access::COLOR_WRITE, Raw::COLOR_ATTACHMENT_WRITE),
        (Access::DEPTH_READ, Raw::DEPTH_STENCIL_ATTACHMENT_READ),
        (Access::DEPTH_WRITE, Raw::DEPTH_STENCIL_ATTACHMENT_WRITE),
        (Access::TRANSFER_READ, Raw::TRANSFER_READ),
        (Access::TRANSFER_WRITE, Raw::TRANSFER_WRITE),
        (Access::ACCEL_READ, if_on(structures, Raw::ACCELERATION_STRUCTURE_READ_KHR)),
        (Access::ACCEL_WRITE, if_on(structures, Raw::ACCELERATION_STRUCTURE_WRITE_KHR)),
        (Access::HOST_READ, Raw::HOST_READ),
        (Access::HOST_WRITE, Raw::HOST_WRITE),
    ];
    table.iter().filter(|(bit, _)| access.contains(*bit)).fold(Raw::NONE, |all, (_, raw)| all | *raw)
}

fn if_on<T: Default>(on: bool, value: T) -> T {
    if on { value } else { T::default() }
}

/// A layout by its Vulkan name.
pub(crate) fn layout(layout: Layout) -> vk::ImageLayout {
    match layout {
        Layout::Undefined => vk::ImageLayout::UNDEFINED,
        Layout::General => vk::ImageLayout::GENERAL,
        Layout::ShaderRead => vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
        Layout::ColorTarget => vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
        Layout::DepthTarget => vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
        Layout::TransferSrc => vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
        Layout::TransferDst => vk::ImageLayout::TRANSFER_DST_OPTIMAL,
    }
}
