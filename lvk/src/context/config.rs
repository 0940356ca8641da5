//! The description of a context.

use std::path::Path;

use crate::gpu::caps::optional_features::OptionalFeature;
use crate::gpu::caps::queues::QueueRequest;
use crate::gpu::caps::ray_query_path::RayQueryRequest;
use crate::gpu::caps::ray_tracing_pipeline_path::RayTracingPipelineRequest;
use crate::gpu::debug::messenger::{ValidationMode, ValidationSink};
use crate::gpu::start::profile::DeviceProfile;
use crate::gpu::start::user_extensions::UserExtensions;
use crate::gpu::start::window::WindowRef;
use crate::resource::ycbcr::YuvConversion;

/// Describes a context.
#[derive(Debug, Clone)]
pub struct ContextDesc<'a> {
    /// Name of the application, for drivers and tools. Default: `"lvk"`.
    pub application_name: &'a str,
    /// The Vulkan loader to open instead of the system's `libvulkan.so.1`. Its code runs in the process, so name only a
    /// library that is as trustworthy as the program. Default: none.
    pub vulkan_library: Option<&'a Path>,
    /// The device to use: its index in [`Context::devices`](crate::Context::devices) or part of its name. The
    /// environment variable `LVK_DEVICE` takes precedence. Without either, the best device that meets the requirements
    /// is used. Default: none.
    pub device: Option<&'a str>,
    /// Amount of checking by the validation layer. Default: [`ValidationMode::Off`].
    pub validation: ValidationMode,
    /// Receiver of the validation layer's messages. All messages go to the `log` crate too. Default: none.
    pub validation_sink: Option<ValidationSink>,
    /// Enables debug names of Vulkan objects and labels of command buffers. `None` enables them where a tool reads
    /// them: with the validation layer, or when a frame debugger or profiler is attached
    /// (`vkGetPhysicalDeviceToolProperties`). Otherwise names cause no driver calls. The library's own errors and
    /// reports always use the names. Default: none.
    pub debug_names: Option<bool>,
    /// Writes the labels of command buffers to the GPU as checkpoints, where the device supports it
    /// (`VK_NV_device_diagnostic_checkpoints`). The report of a lost device then says which labels had begun and ended
    /// ([`DeviceLossReport`](crate::DeviceLossReport)). Each begin and end of a label costs a command then. Without it,
    /// or on other devices, the report lists unfinished submissions with all of their labels. Default: false.
    pub checkpoints: bool,
    /// Makes shaders check every index of a bindless array before use. A wrong index is recorded with the name of the
    /// object that it belonged to, for [`Context::index_faults`](crate::Context::index_faults); the access uses the
    /// default descriptor of slot 0. A texture that lacks a declaration in [`Dependencies`](crate::Dependencies) is
    /// recorded too. The end of the context logs the faults unless all of them were asked for. For debugging only: every
    /// access costs several memory reads, commands no longer overlap, and pipelines are compiled again in every run. See
    /// the manual's page on [debugging](crate::manual::debugging). Default: false.
    pub check_indices: bool,
    /// Request for ray tracing pipelines, and for the path of their implementation: the device's own pipelines, or
    /// compute shaders that the library makes of them. [`Capabilities`](crate::Capabilities) reports the chosen path and
    /// the reason. Default: [`RayTracingPipelineRequest::Auto`].
    pub ray_tracing_pipeline: RayTracingPipelineRequest,
    /// Request for ray queries in any shader stage, and for the hardware or software path of their traversal.
    /// [`Capabilities`](crate::Capabilities) reports the chosen path and the reason.
    /// Default: [`RayQueryRequest::Auto`].
    pub ray_query: RayQueryRequest,
    /// Use of compute and transfer queues beside the graphics queue. With `check_indices` they are never used.
    /// Default: [`QueueRequest::OwnHardware`].
    pub queues: QueueRequest,
    /// Required optional features. Only devices that have all of them are considered. Default: empty.
    pub required_features: &'a [OptionalFeature],
    /// Extensions and features that the application requests itself. Only devices with these extensions are considered.
    /// Default: empty.
    pub user_extensions: UserExtensions<'a>,
    /// A window that the device must be able to present to. Swapchains without a window of their own use it, see
    /// [`Context::create_swapchain`](crate::Context::create_swapchain). `None` for contexts without windows, which use
    /// no extension of any window system. Default: none.
    #[cfg(feature = "window")]
    pub window: Option<std::sync::Arc<dyn crate::WindowHandles>>,
    /// A weaker device to emulate on this device. It applies to the requirements above as well. `None` uses the device
    /// as it is. Default: none.
    pub profile: Option<&'a DeviceProfile>,
    /// Number of frames that the CPU may be ahead of the GPU, clamped to 1 to 8. See
    /// [`Context::next_frame`](crate::Context::next_frame). Default: 2.
    pub frames_in_flight: u32,
    /// Staging memory that is kept, in bytes. Uploads are submitted automatically once they fill half of it. A larger
    /// single upload takes more memory temporarily. Values of [`CommandBuffer::upload`](crate::CommandBuffer::upload)
    /// lie in it too, and one value may have at most this size. 64 KiB are kept at least. Default: 16 MiB.
    pub staging_bytes: u64,
    /// Maximum scratch memory for builds of acceleration structures, in bytes. Counts replaced buffers that the GPU
    /// still uses. One build that needs more gets it. Default: 64 MiB.
    pub scratch_budget_bytes: u64,
    /// Maximum memory for acceleration structures, in bytes. A creation that would exceed it fails and leaves no object
    /// behind. Compaction frees some of it.
    ///
    /// The budget counts BLAS and TLAS with all parts, including destroyed ones that the GPU may still use. It does not
    /// count unused space in shared buffers, scratch memory ([`AccelMemory`](crate::AccelMemory) reports both), or the
    /// tables and gathered inputs of meshes that are split or reordered
    /// ([`AccelStructInfo::table_bytes`](crate::AccelStructInfo::table_bytes)). Default: `u64::MAX`, no limit.
    pub accel_budget_bytes: u64,
    /// Number of texture slots in the bindless set. It is clamped to the number that the device allows beside the other
    /// bindings of the set, and to [`Limits::max_bindless_textures`](crate::Limits::max_bindless_textures).
    /// Default: 16,384.
    pub max_textures: u32,
    /// Y'CbCr conversions that textures may use. A conversion that the device lacks is an error only when such a
    /// texture is created. Default: [`YuvConversion::DEFAULT`].
    pub yuv: &'a [YuvConversion],
    /// Number of texture slots for each of these conversions: at most 1,024, and at most half of the device's
    /// descriptors. Default: 7.
    pub max_yuv_textures: u32,
    /// A file that keeps compiled pipelines between runs (`VkPipelineCache`). It is read at the start. It is replaced
    /// by [`Context::save_pipeline_cache`](crate::Context::save_pipeline_cache) and at the end of the context.
    ///
    /// A file that is damaged, or of another device or driver, is ignored with a warning to the `log` crate, and is
    /// never an error. Drivers trust its contents, so keep it in a folder that only the program can write to.
    ///
    /// Caches are written under temporary names and then renamed. Files that a killed process has left are removed an hour
    /// later, at the start of a context with the same cache. Under a limit of file sizes (`ulimit -f`), a program must
    /// handle or ignore the signal SIGXFSZ; else it ends the process in the middle of a write. Default: none.
    pub pipeline_cache: Option<&'a Path>,
    /// A folder that keeps the SPIR-V of GLSL modules between runs. The key of a file is a checksum of the source, the
    /// defines, the library's preamble for the device and the compiler version. Included sources are compared in full
    /// as well. The folder is created when needed, and several contexts may share it. Above 64 MiB, the least recently
    /// used files are removed; files of other programs are left unchanged.
    ///
    /// A file that is damaged, or of another version, is ignored with a warning to the `log` crate and written again,
    /// and is never an error. Compiler warnings are reported when a module is compiled, not when it is found in the
    /// cache. Keep the folder where only the program writes to it. Use another folder for builds with another version
    /// of the `glslang` crate. Default: none.
    pub shader_cache: Option<&'a Path>,
    /// A folder that keeps the BVHs that the CPU builds for software ray queries between runs. The key of a file is the
    /// checksum of the primitives and settings of the build. The folder is created when needed and never emptied.
    ///
    /// A file that is damaged, or of another version, is ignored with a warning to the `log` crate and written again,
    /// and is never an error. Keep the folder where only the program writes to it. Without the feature
    /// `software-ray-query` the folder is not used. Default: none.
    pub tree_cache: Option<&'a Path>,
}

impl Default for ContextDesc<'_> {
    fn default() -> Self {
        Self {
            application_name: "lvk",
            vulkan_library: None,
            device: None,
            validation: ValidationMode::Off,
            validation_sink: None,
            debug_names: None,
            checkpoints: false,
            check_indices: false,
            ray_tracing_pipeline: RayTracingPipelineRequest::Auto,
            ray_query: RayQueryRequest::default(),
            queues: QueueRequest::default(),
            required_features: &[],
            user_extensions: UserExtensions::default(),
            #[cfg(feature = "window")]
            window: None,
            profile: None,
            frames_in_flight: 2,
            staging_bytes: 16 << 20,
            scratch_budget_bytes: 64 << 20,
            accel_budget_bytes: u64::MAX,
            max_textures: 16_384,
            yuv: &YuvConversion::DEFAULT,
            max_yuv_textures: 7,
            pipeline_cache: None,
            shader_cache: None,
            tree_cache: None,
        }
    }
}

impl ContextDesc<'_> {
    /// Returns the window that the device must be able to present to.
    #[cfg(feature = "window")]
    pub(crate) fn window_ref(&self) -> Option<WindowRef<'_>> {
        self.window.as_deref()
    }

    /// Returns `None`: without the feature `window` the device need not present.
    #[cfg(not(feature = "window"))]
    pub(crate) fn window_ref(&self) -> Option<WindowRef<'_>> {
        None
    }
}
