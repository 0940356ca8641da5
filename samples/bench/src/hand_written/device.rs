//! The device of a context, with the ray tracing extensions.

use std::rc::Rc;

use lvk::Context;
use lvk::ash::{self, khr, vk};

/// The device of a context, with the ray tracing extensions.
pub(crate) struct RawDevice {
    pub(super) device: ash::Device,
    pub(super) accel: khr::acceleration_structure::Device,
    pub(super) tracing: khr::ray_tracing_pipeline::Device,
    pub(super) memory: vk::PhysicalDeviceMemoryProperties,
    /// Keeps the device alive.
    pub(super) ctx: Context,
}

impl RawDevice {
    /// Takes the device of a context that can build acceleration structures.
    pub(crate) fn new(ctx: &Context) -> Rc<Self> {
        let (instance, device) = (ctx.raw_instance(), ctx.raw_device());
        // SAFETY: the physical device belongs to the instance.
        let memory = unsafe { instance.get_physical_device_memory_properties(ctx.raw_physical_device()) };
        Rc::new(Self {
            accel: khr::acceleration_structure::Device::new(instance, device),
            tracing: khr::ray_tracing_pipeline::Device::new(instance, device),
            device: device.clone(),
            memory,
            ctx: ctx.clone(),
        })
    }

    /// Returns a memory type among the `allowed` bits with these properties.
    pub(super) fn memory_type(&self, allowed: u32, wanted: vk::MemoryPropertyFlags) -> Option<u32> {
        let types = (0..).zip(self.memory.memory_types_as_slice());
        let fits = |(index, ty): &(u32, &vk::MemoryType)| {
            allowed >> *index & 1 == 1 && ty.property_flags.contains(wanted)
        };
        types.into_iter().find(fits).map(|(index, _)| index)
    }
}
