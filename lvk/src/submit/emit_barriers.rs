//! Translates the tracker's barriers into one `vkCmdPipelineBarrier2`.

use ash::vk;

use super::queue_sync::OwnershipTransfer;
use crate::barrier::{Access, Barriers, IdMap, ImageBarrier, Layout, MemoryBarrier, Stages};
use crate::gpu::Gpu;
use crate::resource::image::BarrierImage;

/// Images that a command buffer uses, by the tracker's ids.
pub(crate) type Images = IdMap<BarrierImage>;

/// The memory barrier translated last, with its Vulkan form. The next barrier is usually the same.
#[derive(Debug, Default)]
pub(crate) struct LastBarrier {
    barrier: MemoryBarrier,
    named: vk::MemoryBarrier2<'static>,
}

impl LastBarrier {
    /// Returns the Vulkan form of a barrier. Calls `translate` only if the barrier differs from the last one.
    #[inline]
    fn get_or_translate(
        &mut self,
        barrier: &MemoryBarrier,
        translate: impl FnOnce(&MemoryBarrier) -> vk::MemoryBarrier2<'static>,
    ) -> &vk::MemoryBarrier2<'static> {
        if self.barrier != *barrier {
            *self = Self { barrier: *barrier, named: translate(barrier) };
        }
        &self.named
    }
}

/// Records the barriers, if there are any. `last` is kept between calls for the same device.
#[inline(always)]
pub(crate) fn emit(
    gpu: &Gpu,
    commands: vk::CommandBuffer,
    barriers: &Barriers,
    images: &Images,
    last: &mut LastBarrier,
) {
    match &barriers.memory {
        None if barriers.images.is_empty() => {}
        Some(memory) if barriers.images.is_empty() && is_whole(gpu, memory) => {
            let named = last.get_or_translate(memory, |barrier| memory_barrier(gpu, barrier));
            record_barriers(gpu, commands, std::slice::from_ref(named), &[]);
        }
        memory => emit_all(gpu, commands, memory.as_ref(), &barriers.images, images),
    }
}

#[inline(never)]
fn emit_all(
    gpu: &Gpu,
    commands: vk::CommandBuffer,
    memory: Option<&MemoryBarrier>,
    barriers: &[ImageBarrier],
    images: &Images,
) {
    let images: Vec<_> = barriers.iter().filter_map(|barrier| image_barrier(gpu, barrier, images)).collect();
    match memory {
        None => record_barriers(gpu, commands, &[], &images),
        Some(memory) if is_whole(gpu, memory) => {
            record_barriers(gpu, commands, &[memory_barrier(gpu, memory)], &images);
        }
        Some(memory) => {
            let parts: Vec<_> = memory.without_ray_queries().map(|part| memory_barrier(gpu, &part)).collect();
            record_barriers(gpu, commands, &parts, &images);
        }
    }
}

/// Returns true if one Vulkan barrier may cover all of the memory barrier.
#[inline]
fn is_whole(gpu: &Gpu, memory: &MemoryBarrier) -> bool {
    gpu.caps.device_ray_queries() || !memory.dst_access.contains(Access::ACCEL_READ)
}

#[inline]
fn record_barriers(
    gpu: &Gpu,
    commands: vk::CommandBuffer,
    memory: &[vk::MemoryBarrier2<'_>],
    images: &[vk::ImageMemoryBarrier2<'_>],
) {
    if memory.is_empty() && images.is_empty() {
        return;
    }
    // An empty list stays null: drivers that copy the lists (Mesa's common code) allocate memory for non-null ones.
    let mut info = vk::DependencyInfo::default();
    if !memory.is_empty() {
        info = info.memory_barriers(memory);
    }
    if !images.is_empty() {
        info = info.image_memory_barriers(images);
    }
    // SAFETY: the command buffer is being recorded outside of a render pass, and the images are alive.
    unsafe { gpu.device.cmd_pipeline_barrier2(commands, &info) };
}

/// Side of a queue family ownership transfer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    /// The queue releases ownership, after all of its earlier work.
    Release,
    /// The queue acquires ownership, before all of its later work.
    Acquire,
}

/// Stages and accesses of one side of an ownership transfer.
pub(crate) struct TransferScope {
    pub(crate) src_stages: vk::PipelineStageFlags2,
    pub(crate) src_access: vk::AccessFlags2,
    pub(crate) dst_stages: vk::PipelineStageFlags2,
    pub(crate) dst_access: vk::AccessFlags2,
}

impl Side {
    /// Returns the stages and accesses that the barrier of this side orders.
    pub(crate) fn scope(self) -> TransferScope {
        use vk::{AccessFlags2 as Access, PipelineStageFlags2 as Stage};
        let (src_access, dst_stages, dst_access) = match self {
            Self::Release => (Access::MEMORY_WRITE, Stage::NONE, Access::NONE),
            Self::Acquire => (Access::NONE, Stage::ALL_COMMANDS, Access::MEMORY_READ | Access::MEMORY_WRITE),
        };
        TransferScope { src_stages: Stage::ALL_COMMANDS, src_access, dst_stages, dst_access }
    }
}

/// Records one side of queue family ownership transfers. Layouts do not change; a semaphore orders the two sides.
pub(crate) fn emit_ownership_transfers(
    gpu: &Gpu,
    commands: vk::CommandBuffer,
    parts: &[OwnershipTransfer],
    images: &Images,
    side: Side,
) {
    let scope = side.scope();
    let barrier = |transfer: &OwnershipTransfer| {
        let image = images.get(&transfer.id)?;
        let families = [transfer.from, transfer.to].map(|queue_index| gpu.queues.family(queue_index));
        let [from, to] = if families[0] == families[1] { [vk::QUEUE_FAMILY_IGNORED; 2] } else { families };
        let barrier = vk::ImageMemoryBarrier2::default()
            .src_stage_mask(scope.src_stages)
            .src_access_mask(scope.src_access)
            .dst_stage_mask(scope.dst_stages)
            .dst_access_mask(scope.dst_access)
            .old_layout(vulkan_layout(transfer.layout))
            .new_layout(vulkan_layout(transfer.layout))
            .src_queue_family_index(from)
            .dst_queue_family_index(to)
            .image(image.raw)
            .subresource_range(image.range(transfer.part));
        Some(barrier)
    };
    let barriers: Vec<_> = parts.iter().filter_map(barrier).collect();
    let info = vk::DependencyInfo::default().image_memory_barriers(&barriers);
    // SAFETY: the command buffer is being recorded outside of a render pass, and the images are alive.
    unsafe { gpu.device.cmd_pipeline_barrier2(commands, &info) };
}

#[inline(never)]
fn memory_barrier(gpu: &Gpu, barrier: &MemoryBarrier) -> vk::MemoryBarrier2<'static> {
    let (src_stages, src_access) = vulkan_scope(gpu, barrier.src_stages, barrier.src_access);
    let (dst_stages, dst_access) = vulkan_scope(gpu, barrier.dst_stages, barrier.dst_access);
    vk::MemoryBarrier2::default()
        .src_stage_mask(src_stages)
        .src_access_mask(src_access)
        .dst_stage_mask(dst_stages)
        .dst_access_mask(dst_access)
}

fn image_barrier(
    gpu: &Gpu,
    barrier: &ImageBarrier,
    images: &Images,
) -> Option<vk::ImageMemoryBarrier2<'static>> {
    let image = images.get(&barrier.id)?;
    let scopes = &barrier.scopes;
    let (src_stages, src_access) = vulkan_scope(gpu, scopes.src_stages, scopes.src_access);
    let (dst_stages, dst_access) = vulkan_scope(gpu, scopes.dst_stages, scopes.dst_access);
    let barrier = vk::ImageMemoryBarrier2::default()
        .src_stage_mask(src_stages)
        .src_access_mask(src_access)
        .dst_stage_mask(dst_stages)
        .dst_access_mask(dst_access)
        .old_layout(vulkan_layout(scopes.old_layout))
        .new_layout(vulkan_layout(scopes.new_layout))
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .image(image.raw)
        .subresource_range(image.range(barrier.subresources));
    Some(barrier)
}

/// Vulkan stage flags, in the order of the bits of `Stages`.
const STAGES: [u64; Stages::COUNT] = {
    use vk::PipelineStageFlags2 as Raw;
    [
        Raw::HOST.as_raw(),
        Raw::ALL_TRANSFER.as_raw(),
        Raw::DRAW_INDIRECT.as_raw(),
        Raw::VERTEX_INPUT.as_raw(),
        Raw::PRE_RASTERIZATION_SHADERS.as_raw(),
        Raw::FRAGMENT_SHADER.as_raw(),
        Raw::EARLY_FRAGMENT_TESTS.as_raw() | Raw::LATE_FRAGMENT_TESTS.as_raw(),
        Raw::COLOR_ATTACHMENT_OUTPUT.as_raw(),
        Raw::COMPUTE_SHADER.as_raw(),
        Raw::RAY_TRACING_SHADER_KHR.as_raw(),
        Raw::ACCELERATION_STRUCTURE_BUILD_KHR.as_raw(),
        Raw::FRAGMENT_SHADING_RATE_ATTACHMENT_KHR.as_raw(),
    ]
};

/// Vulkan access flags, in the order of the bits of `Access`.
const ACCESSES: [u64; 17] = {
    use vk::AccessFlags2 as Raw;
    [
        Raw::INDIRECT_COMMAND_READ.as_raw(),
        Raw::INDEX_READ.as_raw(),
        Raw::VERTEX_ATTRIBUTE_READ.as_raw(),
        Raw::SHADER_READ.as_raw(),
        Raw::SHADER_WRITE.as_raw(),
        Raw::COLOR_ATTACHMENT_READ.as_raw(),
        Raw::COLOR_ATTACHMENT_WRITE.as_raw(),
        Raw::DEPTH_STENCIL_ATTACHMENT_READ.as_raw(),
        Raw::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw(),
        Raw::TRANSFER_READ.as_raw(),
        Raw::TRANSFER_WRITE.as_raw(),
        Raw::ACCELERATION_STRUCTURE_READ_KHR.as_raw(),
        Raw::ACCELERATION_STRUCTURE_WRITE_KHR.as_raw(),
        Raw::HOST_READ.as_raw(),
        Raw::HOST_WRITE.as_raw(),
        Raw::INPUT_ATTACHMENT_READ.as_raw(),
        Raw::FRAGMENT_SHADING_RATE_ATTACHMENT_READ_KHR.as_raw(),
    ]
};

/// Number of bits that one table look-up translates.
const AT_ONCE: usize = 6;

/// Vulkan flags of each combination of `AT_ONCE` neighbouring bits.
type Names<const N: usize> = [[u64; 1 << AT_ONCE]; N];

static STAGE_NAMES: Names<2> = flag_table(&STAGES);
static ACCESS_NAMES: Names<3> = flag_table(&ACCESSES);

const fn flag_table<const N: usize>(single: &[u64]) -> Names<N> {
    let mut names = [[0; 1 << AT_ONCE]; N];
    let mut bit = 0;
    while bit < single.len() {
        let mut set = 0;
        while set < 1 << AT_ONCE {
            if set >> (bit % AT_ONCE) & 1 == 1 {
                names[bit / AT_ONCE][set] |= single[bit];
            }
            set += 1;
        }
        bit += 1;
    }
    names
}

#[inline]
fn combine_flags<const N: usize>(names: &Names<N>, bits: u32) -> u64 {
    let mut all = 0;
    for (group, names) in names.iter().enumerate() {
        all |= names[(bits >> (group * AT_ONCE)) as usize % names.len()];
    }
    all
}

/// Returns the Vulkan flags of stages, without stages whose feature is disabled.
#[inline]
pub(super) fn vulkan_stages(gpu: &Gpu, stages: Stages) -> vk::PipelineStageFlags2 {
    let stages = stages - disabled_stages(gpu);
    stage_names(stages) | micromap_scope(gpu, stages, Access::empty()).0
}

/// Returns the Vulkan flags of one side of a barrier, without stages and accesses of disabled features.
#[inline]
fn vulkan_scope(gpu: &Gpu, stages: Stages, access: Access) -> (vk::PipelineStageFlags2, vk::AccessFlags2) {
    let mut off = Access::empty();
    off.set(Access::ACCEL_READ | Access::ACCEL_WRITE, gpu.accel.is_none());
    let (stages, access) = without_stages(stages, access - off, disabled_stages(gpu));
    let (micromap_stages, micromap_access) = micromap_scope(gpu, stages, access);
    let access = vk::AccessFlags2::from_raw(combine_flags(&ACCESS_NAMES, access.bits()));
    (stage_names(stages) | micromap_stages, access | micromap_access)
}

/// Returns the Vulkan flags of builds of opacity micromaps, which are tracked as builds of acceleration structures.
#[inline]
fn micromap_scope(gpu: &Gpu, stages: Stages, access: Access) -> (vk::PipelineStageFlags2, vk::AccessFlags2) {
    match gpu.micromaps.is_some() && stages.contains(Stages::ACCEL_BUILD) {
        true => (vk::PipelineStageFlags2::MICROMAP_BUILD_EXT, micromap_access(access)),
        false => Default::default(),
    }
}

fn micromap_access(access: Access) -> vk::AccessFlags2 {
    let mut raw = vk::AccessFlags2::empty();
    if access.contains(Access::ACCEL_READ) {
        raw |= vk::AccessFlags2::MICROMAP_READ_EXT;
    }
    if access.contains(Access::ACCEL_WRITE) {
        raw |= vk::AccessFlags2::MICROMAP_WRITE_EXT;
    }
    raw
}

/// Returns the stages whose feature is disabled.
#[inline]
fn disabled_stages(gpu: &Gpu) -> Stages {
    let mut off = Stages::empty();
    off.set(Stages::RAY_TRACING, gpu.ray_tracing.is_none());
    off.set(Stages::ACCEL_BUILD, gpu.accel.is_none());
    off
}

/// Removes the stages `off`, and accesses that only these stages perform. (Builds copy as well.)
#[inline]
fn without_stages(stages: Stages, access: Access, off: Stages) -> (Stages, Access) {
    let left = stages - off;
    if left == stages { (stages, access) } else { (left, access & left.possible_accesses()) }
}

fn stage_names(stages: Stages) -> vk::PipelineStageFlags2 {
    vk::PipelineStageFlags2::from_raw(combine_flags(&STAGE_NAMES, stages.bits().into()))
}

/// Returns the Vulkan form of a layout.
pub(crate) fn vulkan_layout(layout: Layout) -> vk::ImageLayout {
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
        Layout::ExternalShaderRead => vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
        Layout::ExternalDepthRead => vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_tables_stand_in_the_order_of_the_bits() {
        use vk::{AccessFlags2, PipelineStageFlags2};
        assert_eq!(Stages::all().bits(), (1 << STAGES.len()) - 1);
        assert_eq!(Access::all().bits(), (1 << ACCESSES.len()) - 1);
        let stage =
            |stages: Stages| PipelineStageFlags2::from_raw(combine_flags(&STAGE_NAMES, stages.bits().into()));
        assert_eq!(
            stage(Stages::COMPUTE | Stages::HOST),
            PipelineStageFlags2::HOST | PipelineStageFlags2::COMPUTE_SHADER
        );
        assert_eq!(stage(Stages::COLOR), PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT);
        assert_eq!(stage(Stages::ACCEL_BUILD), PipelineStageFlags2::ACCELERATION_STRUCTURE_BUILD_KHR);
        let access = |access: Access| AccessFlags2::from_raw(combine_flags(&ACCESS_NAMES, access.bits()));
        assert_eq!(access(Access::SHADER_WRITE), AccessFlags2::SHADER_WRITE);
        assert_eq!(access(Access::DEPTH_WRITE), AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE);
        assert_eq!(access(Access::ACCEL_READ), AccessFlags2::ACCELERATION_STRUCTURE_READ_KHR);
        assert_eq!(access(Access::HOST_WRITE), AccessFlags2::HOST_WRITE);
        assert_eq!(access(Access::INPUT_READ), AccessFlags2::INPUT_ATTACHMENT_READ);
        let rates = AccessFlags2::FRAGMENT_SHADING_RATE_ATTACHMENT_READ_KHR;
        assert_eq!(access(Access::SHADING_RATE_READ), rates);
        assert!(access(Access::empty()).is_empty());
    }

    #[test]
    fn micromaps_are_read_and_written_where_structures_are() {
        assert_eq!(micromap_access(Access::SHADER_READ), vk::AccessFlags2::empty());
        assert_eq!(micromap_access(Access::ACCEL_READ), vk::AccessFlags2::MICROMAP_READ_EXT);
        assert_eq!(micromap_access(Access::ACCEL_WRITE), vk::AccessFlags2::MICROMAP_WRITE_EXT);
    }

    #[test]
    fn accesses_of_disabled_stages_are_dropped_with_them() {
        let build = Stages::ACCEL_BUILD;
        let read = Access::SHADER_READ | Access::TRANSFER_READ;
        assert_eq!(
            without_stages(Stages::COMPUTE | build, read, build),
            (Stages::COMPUTE, Access::SHADER_READ)
        );
        assert_eq!(without_stages(build, read, build), (Stages::empty(), Access::empty()));
        let both = Stages::TRANSFER | build;
        assert_eq!(
            without_stages(both, Access::TRANSFER_READ, build),
            (Stages::TRANSFER, Access::TRANSFER_READ)
        );
        assert_eq!(without_stages(both, read, Stages::RAY_TRACING), (both, read));
    }

    fn some_barrier() -> impl Strategy<Value = MemoryBarrier> {
        (0..3_u16, 0..3_u32, 0..3_u16, 0..3_u32).prop_map(
            |(src_stages, src_access, dst_stages, dst_access)| MemoryBarrier {
                src_stages: Stages::from_bits_retain(src_stages),
                src_access: Access::from_bits_retain(src_access),
                dst_stages: Stages::from_bits_retain(dst_stages),
                dst_access: Access::from_bits_retain(dst_access),
            },
        )
    }

    /// Translates like [`memory_barrier`], for a device with all features.
    fn all_named(barrier: &MemoryBarrier) -> vk::MemoryBarrier2<'static> {
        let stages = |stages: Stages| {
            vk::PipelineStageFlags2::from_raw(combine_flags(&STAGE_NAMES, stages.bits().into()))
        };
        let access = |access: Access| vk::AccessFlags2::from_raw(combine_flags(&ACCESS_NAMES, access.bits()));
        vk::MemoryBarrier2::default()
            .src_stage_mask(stages(barrier.src_stages))
            .src_access_mask(access(barrier.src_access))
            .dst_stage_mask(stages(barrier.dst_stages))
            .dst_access_mask(access(barrier.dst_access))
    }

    fn masks(barrier: &vk::MemoryBarrier2<'_>) -> [u64; 4] {
        let (src, dst) = (barrier.src_stage_mask, barrier.dst_stage_mask);
        [src.as_raw(), barrier.src_access_mask.as_raw(), dst.as_raw(), barrier.dst_access_mask.as_raw()]
    }

    proptest! {
        /// Includes barriers that differ from the last one in a single mask.
        #[test]
        fn a_barrier_has_its_own_names_whatever_came_before(
            barriers in prop::collection::vec(some_barrier(), 0..40)
        ) {
            let mut last = LastBarrier::default();
            for barrier in barriers {
                prop_assert_eq!(masks(last.get_or_translate(&barrier, all_named)), masks(&all_named(&barrier)));
            }
        }

        #[test]
        fn a_mask_has_the_names_of_all_its_bits(bits in 0..1_u32 << ACCESSES.len()) {
            let of = |single: &[u64]| {
                let set = single.iter().enumerate().filter(|(bit, _)| bits >> bit & 1 == 1);
                set.fold(0, |all, (_, name)| all | name)
            };
            prop_assert_eq!(combine_flags(&ACCESS_NAMES, bits), of(&ACCESSES));
            prop_assert_eq!(combine_flags(&STAGE_NAMES, bits % (1 << STAGES.len())), of(&STAGES));
        }
    }
}
