//! Turns barriers the tracker decided into one `vkCmdPipelineBarrier2`.

use ash::vk;

use super::lanes::MovedPart;
use crate::barrier::{Access, Barriers, IdMap, ImageBarrier, Layout, MemoryBarrier, Stages};
use crate::gpu::Gpu;
use crate::resource::image::BarrierImage;

/// Images a command buffer touches, by the id the tracker knows them by.
pub(crate) type Images = IdMap<BarrierImage>;

/// Records the barriers, if there are any.
pub(crate) fn emit(gpu: &Gpu, commands: vk::CommandBuffer, barriers: &Barriers, images: &Images) {
    if barriers.is_empty() {
        return;
    }
    let mut memory = [vk::MemoryBarrier2::default(); 2];
    let count = memory_barriers(gpu, barriers.memory.as_ref(), &mut memory);
    let images: Vec<_> =
        barriers.images.iter().filter_map(|barrier| image_barrier(gpu, barrier, images)).collect();
    if count == 0 && images.is_empty() {
        return;
    }
    let info = vk::DependencyInfo::default().memory_barriers(&memory[..count]).image_memory_barriers(&images);
    // SAFETY: the command buffer is being recorded outside of a render pass, and the images are alive.
    unsafe { gpu.device.cmd_pipeline_barrier2(commands, &info) };
}

/// Which side of a change of owner.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    /// The lane gives away, behind everything it has got.
    Release,
    /// The lane takes, in front of everything it gets.
    Acquire,
}

/// Records one side of changes of owner; the layouts stay, and a semaphore stands between both sides.
pub(crate) fn emit_moves(
    gpu: &Gpu,
    commands: vk::CommandBuffer,
    parts: &[MovedPart],
    images: &Images,
    side: Side,
) {
    use vk::{AccessFlags2 as Access, PipelineStageFlags2 as Stage};
    let (src_access, dst_stages, dst_access) = match side {
        Side::Release => (Access::MEMORY_WRITE, Stage::NONE, Access::NONE),
        Side::Acquire => (Access::NONE, Stage::ALL_COMMANDS, Access::MEMORY_READ | Access::MEMORY_WRITE),
    };
    let barrier = |moved: &MovedPart| {
        let image = images.get(&moved.id)?;
        let families = [moved.from, moved.to].map(|lane| gpu.queues.family(lane));
        let [from, to] = if families[0] == families[1] { [vk::QUEUE_FAMILY_IGNORED; 2] } else { families };
        let barrier = vk::ImageMemoryBarrier2::default()
            .src_stage_mask(Stage::ALL_COMMANDS)
            .src_access_mask(src_access)
            .dst_stage_mask(dst_stages)
            .dst_access_mask(dst_access)
            .old_layout(layout(moved.layout))
            .new_layout(layout(moved.layout))
            .src_queue_family_index(from)
            .dst_queue_family_index(to)
            .image(image.raw)
            .subresource_range(image.range(moved.part));
        Some(barrier)
    };
    let barriers: Vec<_> = parts.iter().filter_map(barrier).collect();
    let info = vk::DependencyInfo::default().image_memory_barriers(&barriers);
    // SAFETY: the command buffer is being recorded outside of a render pass, and the images are alive.
    unsafe { gpu.device.cmd_pipeline_barrier2(commands, &info) };
}

/// Writes the barrier, in two parts where one must not name all, and answers how many.
#[inline]
fn memory_barriers(
    gpu: &Gpu,
    barrier: Option<&MemoryBarrier>,
    out: &mut [vk::MemoryBarrier2<'static>; 2],
) -> usize {
    let Some(barrier) = barrier else { return 0 };
    if !barrier.dst_access.contains(Access::ACCEL_READ) || gpu.caps.hardware_ray_query() {
        out[0] = memory_barrier(gpu, barrier);
        return 1;
    }
    let parts = barrier.without_ray_queries().zip(&mut *out);
    parts.map(|(part, place)| *place = memory_barrier(gpu, &part)).count()
}

#[inline]
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

/// Stages by their Vulkan names, in the order of their bits.
const STAGES: [vk::PipelineStageFlags2; Stages::COUNT] = {
    use vk::PipelineStageFlags2 as Raw;
    [
        Raw::HOST,
        Raw::ALL_TRANSFER,
        Raw::DRAW_INDIRECT,
        Raw::VERTEX_INPUT,
        Raw::PRE_RASTERIZATION_SHADERS,
        Raw::FRAGMENT_SHADER,
        Raw::from_raw(Raw::EARLY_FRAGMENT_TESTS.as_raw() | Raw::LATE_FRAGMENT_TESTS.as_raw()),
        Raw::COLOR_ATTACHMENT_OUTPUT,
        Raw::COMPUTE_SHADER,
        Raw::RAY_TRACING_SHADER_KHR,
        Raw::ACCELERATION_STRUCTURE_BUILD_KHR,
        Raw::FRAGMENT_SHADING_RATE_ATTACHMENT_KHR,
    ]
};

/// Accesses by their Vulkan names, in the order of their bits.
const ACCESSES: [vk::AccessFlags2; 17] = {
    use vk::AccessFlags2 as Raw;
    [
        Raw::INDIRECT_COMMAND_READ,
        Raw::INDEX_READ,
        Raw::VERTEX_ATTRIBUTE_READ,
        Raw::SHADER_READ,
        Raw::SHADER_WRITE,
        Raw::COLOR_ATTACHMENT_READ,
        Raw::COLOR_ATTACHMENT_WRITE,
        Raw::DEPTH_STENCIL_ATTACHMENT_READ,
        Raw::DEPTH_STENCIL_ATTACHMENT_WRITE,
        Raw::TRANSFER_READ,
        Raw::TRANSFER_WRITE,
        Raw::ACCELERATION_STRUCTURE_READ_KHR,
        Raw::ACCELERATION_STRUCTURE_WRITE_KHR,
        Raw::HOST_READ,
        Raw::HOST_WRITE,
        Raw::INPUT_ATTACHMENT_READ,
        Raw::FRAGMENT_SHADING_RATE_ATTACHMENT_READ_KHR,
    ]
};

/// Stages by their Vulkan names, without those whose feature is off.
pub(super) fn stages(gpu: &Gpu, stages: Stages) -> vk::PipelineStageFlags2 {
    let mut off = Stages::empty();
    off.set(Stages::RAY_TRACING, gpu.ray_tracing.is_none());
    off.set(Stages::ACCEL_BUILD, gpu.accel.is_none());
    let all = set_bits((stages - off).bits().into(), &STAGES);
    all.fold(vk::PipelineStageFlags2::NONE, |all, raw| all | raw)
}

/// Accesses by their Vulkan names, without those whose feature is off.
fn access(gpu: &Gpu, access: Access) -> vk::AccessFlags2 {
    let mut off = Access::empty();
    off.set(Access::ACCEL_READ | Access::ACCEL_WRITE, gpu.accel.is_none());
    let all = set_bits((access - off).bits(), &ACCESSES);
    all.fold(vk::AccessFlags2::NONE, |all, raw| all | raw)
}

/// What the table has for each bit that is set: mostly one or two.
fn set_bits<T: Copy>(bits: u32, table: &[T]) -> impl Iterator<Item = T> {
    let mut left = bits;
    std::iter::from_fn(move || {
        let place = left.trailing_zeros() as usize;
        left &= left.wrapping_sub(1);
        table.get(place).copied()
    })
}

/// The layout of this name in Vulkan, where it can be that of an image of somebody else's.
pub(crate) fn known_layout(raw: vk::ImageLayout) -> Result<Layout, String> {
    use Layout::{ColorTarget, DepthTarget, General, ShaderRead, TransferDst, TransferSrc, Undefined};
    let all = [Undefined, General, ShaderRead, ColorTarget, DepthTarget, TransferSrc, TransferDst];
    all.into_iter().find(|known| layout(*known) == raw).ok_or_else(|| {
        let names: Vec<_> = all.into_iter().map(|known| format!("{:?}", layout(known))).collect();
        format!("the layout {raw:?} cannot be exchanged; take one of {}", names.join(", "))
    })
}

/// A layout by its Vulkan name.
pub(crate) fn layout(layout: Layout) -> vk::ImageLayout {
    match layout {
        Layout::Undefined => vk::ImageLayout::UNDEFINED,
        Layout::General => vk::ImageLayout::GENERAL,
        Layout::ShaderRead => vk::ImageLayout::READ_ONLY_OPTIMAL,
        Layout::ColorTarget => vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
        Layout::DepthTarget => vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
        Layout::TransferSrc => vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
        Layout::TransferDst => vk::ImageLayout::TRANSFER_DST_OPTIMAL,
        Layout::Present => vk::ImageLayout::PRESENT_SRC_KHR,
        Layout::LocalRead => vk::ImageLayout::RENDERING_LOCAL_READ_KHR,
        Layout::ShadingRate => vk::ImageLayout::FRAGMENT_SHADING_RATE_ATTACHMENT_OPTIMAL_KHR,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_stand_in_the_order_of_the_bits() {
        use vk::{AccessFlags2, PipelineStageFlags2};
        assert_eq!(Stages::all().bits(), (1 << STAGES.len()) - 1);
        assert_eq!(Access::all().bits(), (1 << ACCESSES.len()) - 1);
        let stage = |stages: Stages| set_bits(stages.bits().into(), &STAGES).collect::<Vec<_>>();
        assert_eq!(
            stage(Stages::COMPUTE | Stages::HOST),
            [PipelineStageFlags2::HOST, PipelineStageFlags2::COMPUTE_SHADER]
        );
        assert_eq!(stage(Stages::COLOR), [PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT]);
        assert_eq!(stage(Stages::ACCEL_BUILD), [PipelineStageFlags2::ACCELERATION_STRUCTURE_BUILD_KHR]);
        let access = |access: Access| set_bits(access.bits(), &ACCESSES).collect::<Vec<_>>();
        assert_eq!(access(Access::SHADER_WRITE), [AccessFlags2::SHADER_WRITE]);
        assert_eq!(access(Access::DEPTH_WRITE), [AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE]);
        assert_eq!(access(Access::ACCEL_READ), [AccessFlags2::ACCELERATION_STRUCTURE_READ_KHR]);
        assert_eq!(access(Access::HOST_WRITE), [AccessFlags2::HOST_WRITE]);
        assert_eq!(access(Access::INPUT_READ), [AccessFlags2::INPUT_ATTACHMENT_READ]);
        let rates = AccessFlags2::FRAGMENT_SHADING_RATE_ATTACHMENT_READ_KHR;
        assert_eq!(access(Access::SHADING_RATE_READ), [rates]);
        assert!(access(Access::empty()).is_empty());
    }
}
