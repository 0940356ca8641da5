//! Vulkan's functions of opacity micromaps that only record their arguments, as no driver at hand has them.

use std::cell::RefCell;
use std::ffi::c_void;

use ash::ext::opacity_micromap::DeviceFn;
use ash::vk::{self, Handle};

/// The arguments of a size query or of a build.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct RecordedBuild {
    pub(crate) target: u64,
    /// Count, level and format of each usage.
    pub(crate) counts: Vec<[u32; 3]>,
    pub(crate) data: u64,
    pub(crate) records: u64,
    pub(crate) stride: u64,
    pub(crate) scratch: u64,
}

thread_local! {
    static RECORDED: RefCell<Vec<RecordedBuild>> = const { RefCell::new(Vec::new()) };
}

/// Returns what was recorded on this thread since the last call.
pub(crate) fn take_recorded() -> Vec<RecordedBuild> {
    RECORDED.take()
}

/// Returns functions of which the size query and the build record their arguments.
pub(crate) fn recording_functions() -> DeviceFn {
    DeviceFn::load(|name| match name.to_bytes() {
        b"vkGetMicromapBuildSizesEXT" => query_sizes as *const c_void,
        b"vkCmdBuildMicromapsEXT" => build as *const c_void,
        _ => std::ptr::null(),
    })
}

unsafe extern "system" fn query_sizes(
    _: vk::Device,
    kind: vk::AccelerationStructureBuildTypeKHR,
    info: *const vk::MicromapBuildInfoEXT<'_>,
    sizes: *mut vk::MicromapBuildSizesInfoEXT<'_>,
) {
    assert_eq!(kind, vk::AccelerationStructureBuildTypeKHR::DEVICE);
    // SAFETY: as for Vulkan's function, the caller passes valid pointers.
    unsafe {
        record(&*info);
        (*sizes).micromap_size = 4096;
        (*sizes).build_scratch_size = 512;
    }
}

unsafe extern "system" fn build(
    _: vk::CommandBuffer,
    count: u32,
    infos: *const vk::MicromapBuildInfoEXT<'_>,
) {
    // SAFETY: as for Vulkan's function, the caller passes `count` valid structures.
    unsafe { std::slice::from_raw_parts(infos, count as usize).iter().for_each(|info| record(info)) };
}

/// # Safety
/// The usage counts of the structure are valid.
unsafe fn record(info: &vk::MicromapBuildInfoEXT<'_>) {
    assert_eq!(
        (info.ty, info.mode),
        (vk::MicromapTypeEXT::OPACITY_MICROMAP, vk::BuildMicromapModeEXT::BUILD)
    );
    // SAFETY: the caller ensures valid counts; builds on the device have addresses.
    let recorded = unsafe {
        let counts = std::slice::from_raw_parts(info.p_usage_counts, info.usage_counts_count as usize);
        RecordedBuild {
            target: info.dst_micromap.as_raw(),
            counts: counts.iter().map(|usage| [usage.count, usage.subdivision_level, usage.format]).collect(),
            data: info.data.device_address,
            records: info.triangle_array.device_address,
            stride: info.triangle_array_stride,
            scratch: info.scratch_data.device_address,
        }
    };
    RECORDED.with_borrow_mut(|all| all.push(recorded));
}
