//! One Vulkan device for wgpu and `lvk`.

use std::ffi::CStr;
use std::future::Future;
use std::pin::pin;
use std::task::{self, Poll, Waker};

use lvk::ash::{self, vk};
use lvk::{Context, ContextDesc};
use lvk_dev_driver::{DriverRequest, prepare};
use wgpu::hal::api::Vulkan;

use crate::Error;

/// The queue family of wgpu.
const FAMILY: u32 = 0;

/// Opens wgpu, a device with the requirements of both libraries, and `lvk` on it.
pub(crate) fn open(validation: bool) -> Result<(Context, wgpu::Device, wgpu::Queue), Error> {
    if let Some(loader) = prepare(&DriverRequest { validation, ..DriverRequest::default() })?.loader {
        // SAFETY: the library is a Vulkan loader. wgpu opens it by its bare name, which finds the open library.
        std::mem::forget(unsafe { ash::Entry::load_from(loader) }?);
    }
    let flags = if validation { wgpu::InstanceFlags::VALIDATION } else { wgpu::InstanceFlags::empty() };
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::VULKAN,
        flags,
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let adapter = ready(instance.request_adapter(&Default::default()))?;
    // SAFETY: nothing of the adapter is destroyed through the guard.
    let hal = unsafe { adapter.as_hal::<Vulkan>() }.ok_or("the adapter is not one of Vulkan")?;
    let (shared, desc) = (hal.shared_instance(), ContextDesc::default());
    let (entry, instance, physical) = (shared.entry(), shared.raw_instance(), hal.raw_physical_device());
    // SAFETY: all of it belongs to the adapter, which outlives the requirements.
    let requirements =
        unsafe { Context::requirements(entry, instance, shared.extensions(), physical, &desc) }?;

    // wgpu's own description of a device, and the requirements of lvk merged into it.
    let features = wgpu::Features::empty();
    let mut names = hal.required_device_extensions(features);
    let mut of_wgpu = hal.physical_device_features(&names, features);
    let pointers: Vec<_> = names.iter().map(|name| name.as_ptr()).collect();
    let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(FAMILY).queue_priorities(&[1.0])];
    let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_extension_names(&pointers);
    let mut of_lvk = requirements.feature_chain();
    // SAFETY: the structures of `info` live until the end of this function, and only this code uses them.
    let info = unsafe { of_lvk.merge_into(of_wgpu.add_to_device_create(info)) }?;
    // SAFETY: the device is created with valid structures, on a physical device of the instance.
    let raw = unsafe { instance.create_device(physical, &info, None) }?;

    names.extend(requirements.extensions().iter().filter(|name| !shared_name(&pointers, name)));
    let (limits, hints) = (wgpu::Limits::default(), wgpu::MemoryHints::default());
    // SAFETY: the device has these extensions and features on, and wgpu owns it from here on.
    let open =
        unsafe { hal.device_from_raw(raw.clone(), None, &names, features, &limits, &hints, FAMILY, 0) }?;
    let desc_of_wgpu = wgpu::DeviceDescriptor { required_limits: limits, ..Default::default() };
    // SAFETY: the device was created by this adapter, with these features.
    let (device, queue) = unsafe { adapter.create_device_from_hal(open, &desc_of_wgpu) }?;

    // SAFETY: the device was created with this queue.
    let raw_queue = unsafe { raw.get_device_queue(FAMILY, 0) };
    let description = requirements.raw_context(raw, [(raw_queue, FAMILY); 3]);
    // SAFETY: the device has all requirements on. It outlives the context, as `Guest` drops the context first. Every
    // submission of wgpu is made inside of `with_raw_queue`.
    let ctx = unsafe { Context::from_raw(description, &desc) }?;
    Ok((ctx, device, queue))
}

fn shared_name(names: &[*const std::ffi::c_char], name: &CStr) -> bool {
    // SAFETY: the names are constants.
    names.iter().any(|known| unsafe { CStr::from_ptr(*known) } == name)
}

/// Returns the output of a future that is ready at once, as wgpu's are without a browser.
fn ready<T, E: Into<Error>>(future: impl Future<Output = Result<T, E>>) -> Result<T, Error> {
    match pin!(future).poll(&mut task::Context::from_waker(Waker::noop())) {
        Poll::Ready(answer) => answer.map_err(Into::into),
        Poll::Pending => Err("wgpu is not ready at once".into()),
    }
}
