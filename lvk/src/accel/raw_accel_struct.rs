//! One Vulkan acceleration structure and its memory.

use std::sync::Arc;

use ash::vk;

use super::storage::{AccelStorage, StorageRange};
use crate::error::{Error, Result};
use crate::gpu::Gpu;

/// One Vulkan acceleration structure, destroyed on drop.
pub(crate) struct RawAccelStruct {
    pub(crate) raw: vk::AccelerationStructureKHR,
    /// Device address, for instances.
    pub(crate) address: u64,
    /// Bytes that it was created with. Its memory may be more.
    pub(crate) bytes: u64,
    storage: StorageRange,
    ext: ash::khr::acceleration_structure::Device,
}

impl RawAccelStruct {
    /// Creates the object with its memory. Builds nothing.
    pub(crate) fn new(
        gpu: &Arc<Gpu>,
        storage: &AccelStorage,
        name: &str,
        ty: vk::AccelerationStructureTypeKHR,
        bytes: u64,
    ) -> Result<Self> {
        let ext = gpu.accel_functions()?.clone();
        let storage = storage.alloc(gpu, name, bytes)?;
        let info = vk::AccelerationStructureCreateInfoKHR::default()
            .buffer(storage.buffer.raw)
            .offset(storage.offset)
            .size(bytes.max(1))
            .ty(ty);
        // SAFETY: the range lies inside a buffer with the usage, and its offset is a multiple of 256.
        let raw = unsafe { ext.create_acceleration_structure(&info, None) }
            .map_err(Error::vulkan("vkCreateAccelerationStructureKHR", name))?;
        gpu.name(raw, name);
        let info = vk::AccelerationStructureDeviceAddressInfoKHR::default().acceleration_structure(raw);
        // SAFETY: the acceleration structure is alive.
        let address = unsafe { ext.get_acceleration_structure_device_address(&info) };
        Ok(Self { raw, address, bytes, storage, ext })
    }

    /// Bytes of its memory.
    pub(crate) fn memory_bytes(&self) -> u64 {
        self.storage.bytes
    }
}

impl Drop for RawAccelStruct {
    fn drop(&mut self) {
        // SAFETY: the owner has waited until the GPU no longer uses the acceleration structure.
        unsafe { self.ext.destroy_acceleration_structure(self.raw, None) };
    }
}
