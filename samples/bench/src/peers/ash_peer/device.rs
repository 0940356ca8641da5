//! Instance, device and queue.

use std::cell::RefCell;
use std::ffi::CStr;

use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use gpu_allocator::{AllocationSizes, AllocatorDebugSettings};
use lvk::ash::{self, khr, vk};

use crate::peers::peer::{Failure, PeerDevice};

/// A device with one queue.
pub(super) struct Device {
    pub(super) raw: ash::Device,
    pub(super) queue: vk::Queue,
    pub(super) family: u32,
    pub(super) allocator: RefCell<Allocator>,
    /// Commands of acceleration structures, if the device has them.
    accel: Option<khr::acceleration_structure::Device>,
    /// Commands of ray tracing pipelines, if the device has them.
    tracing: Option<khr::ray_tracing_pipeline::Device>,
    pub(super) has_ray_query: bool,
    physical: vk::PhysicalDevice,
    instance: ash::Instance,
    _entry: ash::Entry,
}

impl Device {
    /// Opens the first device.
    pub(super) fn new() -> Result<Self, Failure> {
        // SAFETY: the loader is in the process already; nothing else is called before it is loaded.
        let entry = unsafe { ash::Entry::load() }?;
        let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let info = vk::InstanceCreateInfo::default().application_info(&application);
        // SAFETY: the description is valid.
        let instance = unsafe { entry.create_instance(&info, None) }?;
        // SAFETY: the instance is alive.
        let physical = unsafe { instance.enumerate_physical_devices() }?;
        let physical = *physical.first().ok_or("there is no device")?;
        // SAFETY: the physical device is one of the instance.
        let families = unsafe { instance.get_physical_device_queue_family_properties(physical) };
        let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
        let family = families.iter().position(|family| family.queue_flags.contains(wanted));
        let family = family.ok_or("no queue draws and computes")? as u32;
        let extensions = Extensions::of_device(&instance, physical)?;
        let raw = create_device(&instance, physical, family, &extensions)?;
        // SAFETY: the device has one queue of this family.
        let queue = unsafe { raw.get_device_queue(family, 0) };
        let mut debug_settings = AllocatorDebugSettings::default();
        debug_settings.log_leaks_on_shutdown = false;
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.clone(),
            device: raw.clone(),
            physical_device: physical,
            debug_settings,
            buffer_device_address: true,
            allocation_sizes: AllocationSizes::default(),
        })?;
        Ok(Self {
            queue,
            family,
            allocator: RefCell::new(allocator),
            accel: extensions.accel.then(|| khr::acceleration_structure::Device::new(&instance, &raw)),
            tracing: extensions.pipeline.then(|| khr::ray_tracing_pipeline::Device::new(&instance, &raw)),
            has_ray_query: extensions.query,
            raw,
            physical,
            instance,
            _entry: entry,
        })
    }

    /// Returns the names of device and driver.
    pub(super) fn description(&self) -> PeerDevice {
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
        // SAFETY: the device is alive, and has Vulkan 1.3.
        unsafe { self.instance.get_physical_device_properties2(self.physical, &mut properties) };
        let is_cpu = properties.properties.device_type == vk::PhysicalDeviceType::CPU;
        let device = text(properties.properties.device_name_as_c_str());
        let (name, info) = (text(driver.driver_name_as_c_str()), text(driver.driver_info_as_c_str()));
        PeerDevice { name: format!("{device}; {name} {info}"), is_cpu }
    }

    /// Returns the commands of acceleration structures.
    pub(super) fn accel(&self) -> Result<&khr::acceleration_structure::Device, Failure> {
        self.accel.as_ref().ok_or_else(|| "the device has no acceleration structures".into())
    }

    /// Returns the commands of ray tracing pipelines.
    pub(super) fn tracing(&self) -> Result<&khr::ray_tracing_pipeline::Device, Failure> {
        self.tracing.as_ref().ok_or_else(|| "the device has no ray tracing pipelines".into())
    }

    /// Returns the alignment of scratch memory in bytes.
    pub(super) fn scratch_alignment(&self) -> u64 {
        let mut accel = vk::PhysicalDeviceAccelerationStructurePropertiesKHR::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut accel);
        // SAFETY: the device has the extension.
        unsafe { self.instance.get_physical_device_properties2(self.physical, &mut properties) };
        u64::from(accel.min_acceleration_structure_scratch_offset_alignment).max(1)
    }

    /// Returns bytes of a handle, and the alignments of handles and of tables.
    pub(super) fn sbt_limits(&self) -> [usize; 3] {
        let mut pipeline = vk::PhysicalDeviceRayTracingPipelinePropertiesKHR::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut pipeline);
        // SAFETY: the device has the extension.
        unsafe { self.instance.get_physical_device_properties2(self.physical, &mut properties) };
        let limits = [
            pipeline.shader_group_handle_size,
            pipeline.shader_group_handle_alignment,
            pipeline.shader_group_base_alignment,
        ];
        limits.map(|limit| limit as usize)
    }
}

/// Extensions for rays that the device has.
struct Extensions {
    accel: bool,
    query: bool,
    pipeline: bool,
}

impl Extensions {
    fn of_device(instance: &ash::Instance, physical: vk::PhysicalDevice) -> Result<Self, Failure> {
        // SAFETY: the physical device is one of the instance.
        let found = unsafe { instance.enumerate_device_extension_properties(physical) }?;
        let has = |name: &CStr| found.iter().any(|one| one.extension_name_as_c_str() == Ok(name));
        let accel = has(vk::KHR_ACCELERATION_STRUCTURE_NAME) && has(vk::KHR_DEFERRED_HOST_OPERATIONS_NAME);
        Ok(Self {
            accel,
            query: accel && has(vk::KHR_RAY_QUERY_NAME),
            pipeline: accel && has(vk::KHR_RAY_TRACING_PIPELINE_NAME),
        })
    }

    fn names(&self) -> Vec<*const std::ffi::c_char> {
        let all = [
            (self.accel, vk::KHR_ACCELERATION_STRUCTURE_NAME),
            (self.accel, vk::KHR_DEFERRED_HOST_OPERATIONS_NAME),
            (self.query, vk::KHR_RAY_QUERY_NAME),
            (self.pipeline, vk::KHR_RAY_TRACING_PIPELINE_NAME),
        ];
        all.iter().filter(|(has, _)| *has).map(|(_, name)| name.as_ptr()).collect()
    }
}

fn create_device(
    instance: &ash::Instance,
    physical: vk::PhysicalDevice,
    family: u32,
    extensions: &Extensions,
) -> Result<ash::Device, Failure> {
    let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&[1.0])];
    let names = extensions.names();
    let mut vulkan_12 = vk::PhysicalDeviceVulkan12Features::default()
        .buffer_device_address(true)
        .descriptor_indexing(true)
        .descriptor_binding_partially_bound(true)
        .runtime_descriptor_array(true)
        .timeline_semaphore(true);
    let mut vulkan_13 =
        vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true).synchronization2(true);
    let mut accel =
        vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default().acceleration_structure(true);
    let mut query = vk::PhysicalDeviceRayQueryFeaturesKHR::default().ray_query(true);
    let mut pipeline = vk::PhysicalDeviceRayTracingPipelineFeaturesKHR::default().ray_tracing_pipeline(true);
    let mut info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&names)
        .push_next(&mut vulkan_12)
        .push_next(&mut vulkan_13);
    if extensions.accel {
        info = info.push_next(&mut accel);
    }
    if extensions.query {
        info = info.push_next(&mut query);
    }
    if extensions.pipeline {
        info = info.push_next(&mut pipeline);
    }
    // SAFETY: the description is valid; a device without the features of Vulkan 1.3 gives an error.
    Ok(unsafe { instance.create_device(physical, &info, None) }?)
}

fn text(name: Result<&CStr, std::ffi::FromBytesUntilNulError>) -> String {
    name.map_or_else(|_| String::new(), |name| name.to_string_lossy().into_owned())
}
