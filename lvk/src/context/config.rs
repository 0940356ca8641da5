//! How a context is made.

use std::path::Path;

use crate::gpu::caps::capabilities::FeatureRequest;
use crate::gpu::caps::optional_features::OptionalFeature;
use crate::gpu::caps::queues::QueueRequest;
use crate::gpu::caps::ray_query_path::RayQueryRequest;
use crate::gpu::debug::messenger::{ValidationMode, ValidationSink};
use crate::gpu::start::profile::DeviceProfile;
use crate::gpu::start::user_extensions::UserExtensions;
use crate::gpu::start::window::WindowRef;
use crate::resource::ycbcr::YuvConversion;

/// Describes a context.
#[derive(Debug, Clone)]
pub struct ContextDesc<'a> {
    /// Name of the application, for drivers and tools.
    pub application_name: &'a str,
    /// The Vulkan loader to open instead of the system's `libvulkan.so.1`.
    pub vulkan_library: Option<&'a Path>,
    /// The device to use: its number in [`Context::devices`](crate::Context::devices) or part of its name. The
    /// environment variable `LVK_DEVICE` goes before it. Without either the best device that has what is required.
    pub device: Option<&'a str>,
    /// How much the validation layer checks.
    pub validation: ValidationMode,
    /// Where messages of the layer go; all go to the `log` crate too.
    pub validation_sink: Option<ValidationSink>,
    /// Whether Vulkan objects get their debug names, and command buffers their labels. Without an answer they do where
    /// somebody reads them: with the validation layer, or when a debugger or profiler of frames says that it is there
    /// (`vkGetPhysicalDeviceToolProperties`). Elsewhere a name costs no call of the driver. The library's own errors and
    /// reports always have names.
    pub debug_names: Option<bool>,
    /// Have shaders look every index of a bindless array up before they use it: a wrong one is written down, with the name
    /// of the object it belonged to, for [`Context::index_faults`](crate::Context::index_faults), and the dummy of slot 0
    /// stands in. For debugging: every access costs several reads of memory, command buffers no longer overlap, and pipelines
    /// are compiled anew in every run. See the manual's page on [debugging](crate::manual::debugging).
    pub check_indices: bool,
    /// Ray tracing pipelines.
    pub ray_tracing_pipeline: FeatureRequest,
    /// Ray queries in any shader stage, and who walks their trees; [`Capabilities`](crate::Capabilities) says which it
    /// became and why.
    pub ray_query: RayQueryRequest,
    /// Whether queues for compute and transfer run beside the one for everything; with `check_indices` they never do.
    pub queues: QueueRequest,
    /// Optional features that are needed: only devices that have them all are considered.
    pub required_features: &'a [OptionalFeature],
    /// Extensions and features of the caller's own; only devices that have the extensions are considered.
    pub user_extensions: UserExtensions<'a>,
    /// A window that the device must be able to show pictures in; swapchains without a window of their own take it, see
    /// [`Context::create_swapchain`](crate::Context::create_swapchain). `None` for contexts without windows, which use no
    /// extension of any window system.
    #[cfg(feature = "window")]
    pub window: Option<std::sync::Arc<dyn crate::WindowHandles>>,
    /// Another device to rehearse on this one, also by the requirements above; none for the device as it is.
    pub profile: Option<&'a DeviceProfile>,
    /// Frames the CPU may be ahead of the GPU; see [`Context::next_frame`](crate::Context::next_frame). 1 to 8.
    pub frames_in_flight: u32,
    /// Staging memory that is kept, in bytes. Uploads are submitted on their own once they fill half of it; single ones that
    /// are larger take more for a while.
    pub staging_bytes: u64,
    /// Most scratch memory for the builds of acceleration structures, in bytes, buffers included that a larger one has
    /// replaced while the GPU still used them. One build that needs more gets it.
    pub scratch_budget_bytes: u64,
    /// Most memory for acceleration structures, in bytes. A creation that would exceed it fails and leaves nothing
    /// behind; compaction gives some back.
    ///
    /// The structures count, of both levels and all parts, and those too that wait for the GPU to be done with them.
    /// What does not: unused room in the buffers that small ones share and scratch memory
    /// ([`AccelMemory`](crate::AccelMemory) tells both), and the tables and gathered inputs of meshes that are split or
    /// reordered ([`AccelStructInfo::table_bytes`](crate::AccelStructInfo::table_bytes)).
    pub accel_budget_bytes: u64,
    /// Room for textures in the bindless set; clamped to what the device allows beside everything else in the set, and
    /// to [`Limits::max_bindless_textures`](crate::Limits::max_bindless_textures).
    pub max_textures: u32,
    /// How textures in Y'CbCr may be converted. What the device lacks of it is an error only when such a texture is made.
    pub yuv: &'a [YuvConversion],
    /// Room for textures of each of these conversions, at most 1,024, and at most what half of the device's descriptors
    /// make.
    pub max_yuv_textures: u32,
    /// A file that keeps compiled pipelines from one run to the next (`VkPipelineCache`). It is read at the start,
    /// replaced by [`Context::save_pipeline_cache`](crate::Context::save_pipeline_cache) and at the end of the context.
    ///
    /// A file that is damaged, or of another device or driver, is dropped with a warning to the `log` crate, never an
    /// error. Drivers trust what is in it, so it belongs into a folder that nobody else can write.
    pub pipeline_cache: Option<&'a Path>,
    /// A folder that keeps the SPIR-V of GLSL modules from one run to the next, each under a checksum of its text, its
    /// defines, the library's preamble for the device and the version of the compiler; what it includes is compared as well,
    /// text by text. It is made when needed, several contexts may share it, and above 64 MiB what was not used for longest
    /// is removed; files of others are left alone.
    ///
    /// A file that is damaged, or of another version, is dropped with a warning to the `log` crate and made anew, never an
    /// error. What the compiler warns of is said when it compiles, not when its words are found. Keep the folder where only
    /// the program writes it, and give builds with another version of the `glslang` crate one of their own.
    pub shader_cache: Option<&'a Path>,
    /// A folder that keeps the trees that the CPU builds where software traces, from one run to the next, each under the
    /// checksum of the primitives and settings it was built from. It is made when needed, and never emptied.
    ///
    /// A file that is damaged, or of another version, is dropped with a warning to the `log` crate and made anew, never an
    /// error. Keep the folder where only the program writes it. Without the feature `software-ray-query` the folder is left
    /// alone.
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
            check_indices: false,
            ray_tracing_pipeline: FeatureRequest::Optional,
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
    /// The window that the device must be able to present to.
    #[cfg(feature = "window")]
    pub(crate) fn window_ref(&self) -> Option<WindowRef<'_>> {
        self.window.as_deref()
    }

    /// The window that the device must be able to present to: none.
    #[cfg(not(feature = "window"))]
    pub(crate) fn window_ref(&self) -> Option<WindowRef<'_>> {
        None
    }
}
