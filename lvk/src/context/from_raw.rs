//! A context on a device that somebody else has made.

use std::sync::Arc;

use super::Context;
use super::config::ContextDesc;
use super::new::requested_queues;
use crate::error::Result;
use crate::gpu::Gpu;
use crate::gpu::start::external::RawContext;

impl Context {
    /// Makes a context on an instance, device and queues of the caller's own, which stay the caller's: nothing of them is
    /// destroyed.
    ///
    /// Of `desc` what belongs to the making of devices is ignored: the library, the device, validation and its sink,
    /// required features, the profile, and extra extensions. Its wishes about ray tracing count as far as `raw` allows them.
    ///
    /// # Safety
    /// The handles must belong together and live until the last clone, holder and command buffer of the context is gone.
    /// What `raw` says is on must have been turned on when the device was made; besides it every feature that
    /// [`Context::new`](Self::new) needs of a device must be on: `bufferDeviceAddress`, `timelineSemaphore`,
    /// `synchronization2`, `dynamicRendering`, `maintenance4`, `scalarBlockLayout`, `hostQueryReset`, `independentBlend`,
    /// `runtimeDescriptorArray`, `descriptorBindingPartiallyBound`, `descriptorBindingUpdateUnusedWhilePending`,
    /// `descriptorBindingSampledImageUpdateAfterBind`, `descriptorBindingStorageImageUpdateAfterBind`,
    /// `shaderSampledImageArrayNonUniformIndexing`, `shaderStorageImageArrayNonUniformIndexing`,
    /// `shaderSampledImageArrayDynamicIndexing`, `shaderStorageImageArrayDynamicIndexing`,
    /// `shaderStorageImageWriteWithoutFormat` and `fragmentStoresAndAtomics`; and what shaders use of
    /// `shaderTerminateInvocation`, `shaderDemoteToHelperInvocation`, `shaderZeroInitializeWorkgroupMemory`,
    /// `shaderIntegerDotProduct`, `shaderSubgroupExtendedTypes` and `vulkanMemoryModel`, which every such device has. Whoever else uses one of the queues does so within
    /// [`with_raw_queue`](Self::with_raw_queue) or [`with_raw_queue_of`](Self::with_raw_queue_of), or while nobody uses the context.
    ///
    /// # Errors
    /// [`NoDevice`](crate::Error::NoDevice) where the device lacks what the library needs;
    /// [`InvalidUsage`](crate::Error::InvalidUsage) where the device cannot have what it is said to have, an extension is
    /// missing from the list, or a queue family cannot do what its queue is for; [`Unsupported`](crate::Error::Unsupported) for
    /// [`RayQueryRequest::Software`](crate::RayQueryRequest::Software) without the feature `software-ray-query`.
    pub unsafe fn from_raw(raw: RawContext<'_>, desc: &ContextDesc<'_>) -> Result<Self> {
        desc.ray_query.check()?;
        let queues = requested_queues(desc);
        // SAFETY: by the caller.
        let gpu = unsafe {
            Gpu::from_raw(raw, desc.ray_tracing_pipeline, desc.ray_query, desc.debug_names, queues)?
        };
        Self::with_gpu(Arc::new(gpu), desc)
    }
}
