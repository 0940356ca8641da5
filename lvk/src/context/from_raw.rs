//! Creation of a context on a device that the application has created.

use std::sync::Arc;

use super::Context;
use super::config::ContextDesc;
use super::new::external_request;
use crate::error::Result;
use crate::gpu::Gpu;
use crate::gpu::start::external::RawContext;

impl Context {
    /// Creates a context on the caller's instance, device and queues. The caller keeps their ownership: the context
    /// destroys none of them.
    ///
    /// [`requirements`](Self::requirements) says what the device needs, and
    /// [`DeviceRequirements::raw_context`](crate::DeviceRequirements::raw_context) fills in `raw`. Members of `desc`
    /// that configure device creation are ignored: the library, the device, the profile, and user extensions. Required
    /// features only count in the choice between the device's ray tracing pipelines and lowered ones. Ray tracing
    /// requests apply as far as `raw` allows them. A window needs the extensions for its window system and for
    /// swapchains in `raw`.
    ///
    /// The caller turns the validation layer on. With [`ContextDesc::validation`], the context receives the layer's
    /// messages about everything on the instance, which needs `VK_EXT_debug_utils` in `raw`. Vulkan does not tell whether
    /// the layer is on: without it, there are no messages.
    ///
    /// # Safety
    /// The handles must belong together and live until the last object that refers to the context is dropped: clones,
    /// holders and command buffers, but also each `SharedSemaphore`, [`Readback`](crate::Readback),
    /// [`PendingPipeline`](crate::PendingPipeline) and `Reloadable`. Everything that `raw` declares as enabled must have been enabled at device creation. In addition every
    /// feature that [`Context::new`](Self::new) needs of a device must be enabled: `bufferDeviceAddress`,
    /// `timelineSemaphore`, `synchronization2`, `dynamicRendering`, `maintenance4`, `scalarBlockLayout`,
    /// `hostQueryReset`, `independentBlend`, `runtimeDescriptorArray`, `descriptorBindingPartiallyBound`,
    /// `descriptorBindingUpdateUnusedWhilePending`, `descriptorBindingSampledImageUpdateAfterBind`,
    /// `descriptorBindingStorageImageUpdateAfterBind`, `shaderSampledImageArrayNonUniformIndexing`,
    /// `shaderStorageImageArrayNonUniformIndexing`, `shaderSampledImageArrayDynamicIndexing`,
    /// `shaderStorageImageArrayDynamicIndexing`, `shaderStorageImageWriteWithoutFormat` and `fragmentStoresAndAtomics`.
    /// The same holds for those of `shaderTerminateInvocation`, `shaderDemoteToHelperInvocation`,
    /// `shaderZeroInitializeWorkgroupMemory`, `shaderIntegerDotProduct`, `shaderSubgroupExtendedTypes` and
    /// `vulkanMemoryModel` that shaders use; every such device has these. All of these features are enabled on a device
    /// that is created with the chain of the requirements
    /// ([`DeviceRequirements::feature_chain`](crate::DeviceRequirements::feature_chain)).
    ///
    /// Other code must use the queues only within [`with_raw_queue`](Self::with_raw_queue) or
    /// [`with_raw_queue_of`](Self::with_raw_queue_of), or while no thread uses the context. The end of the context waits
    /// for these queues. Other queues of the device are the caller's alone.
    ///
    /// # Errors
    /// [`NoDevice`](crate::Error::NoDevice) where the device lacks a requirement of the library;
    /// [`InvalidUsage`](crate::Error::InvalidUsage), whose object is the field of `raw`, for null handles, a physical
    /// device that is not of the instance, features that the device cannot have, extensions that a feature or the window
    /// needs and that are not listed, queue families that lack a capability, and one queue with two families;
    /// [`Unsupported`](crate::Error::Unsupported) for [`RayQueryRequest::Software`](crate::RayQueryRequest::Software) and
    /// [`RayTracingPipelineRequest::Software`](crate::RayTracingPipelineRequest::Software) without the feature
    /// `software-ray-query`.
    pub unsafe fn from_raw(raw: RawContext<'_>, desc: &ContextDesc<'_>) -> Result<Self> {
        desc.ray_query.check()?;
        desc.ray_tracing_pipeline.check()?;
        // SAFETY: by the caller's promise.
        let gpu = unsafe { Gpu::from_raw(raw, &external_request(desc))? };
        Self::with_gpu(Arc::new(gpu), desc)
    }
}
