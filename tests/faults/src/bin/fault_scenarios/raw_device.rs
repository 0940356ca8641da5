//! A context on a device that another engine has created.

use std::ffi::CStr;

use lvk::ash::{self, vk};
use lvk::{Context, ContextDesc, RawSignal, ValidationMode};
use lvk_dev_driver::prepare;
use lvk_faults::layer::NAMES_VARIABLE;

use crate::compute::{read_words, record_step, step_pipeline, words_buffer};
use crate::{Failure, driver_request, validation};

/// Turns an error of the engine's own calls into one that names the command and its object.
fn in_call(command: &'static str, object: &'static str) -> impl Fn(vk::Result) -> Failure {
    move |result| format!("{command} failed for '{object} of the engine': {result}").into()
}

/// Instance of the engine, destroyed at the end.
struct EngineInstance {
    entry: ash::Entry,
    raw: ash::Instance,
}

impl Drop for EngineInstance {
    fn drop(&mut self) {
        // SAFETY: the device is destroyed first.
        unsafe { self.raw.destroy_instance(None) };
    }
}

/// Device of the engine, destroyed at the end.
struct EngineDevice {
    raw: ash::Device,
}

impl Drop for EngineDevice {
    fn drop(&mut self) {
        // SAFETY: the context and the semaphore are destroyed first.
        unsafe { self.raw.destroy_device(None) };
    }
}

/// Timeline semaphore of the engine, destroyed at the end.
struct EngineSemaphore<'a> {
    device: &'a ash::Device,
    raw: vk::Semaphore,
}

impl<'a> EngineSemaphore<'a> {
    fn new(device: &'a ash::Device) -> Result<Self, Failure> {
        let mut timeline = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut timeline);
        // SAFETY: the description is valid.
        let raw = unsafe { device.create_semaphore(&info, None) }
            .map_err(in_call("vkCreateSemaphore", "semaphore"))?;
        Ok(Self { device, raw })
    }
}

impl Drop for EngineSemaphore<'_> {
    fn drop(&mut self) {
        // SAFETY: the engine waits for the device before.
        unsafe {
            if let Err(result) = self.device.device_wait_idle() {
                let error = in_call("vkDeviceWaitIdle", "device")(result);
                eprintln!("warning: the semaphore of the engine may be in use: {error}");
            }
            self.device.destroy_semaphore(self.raw, None);
        }
    }
}

/// Runs a step on the engine's device; the engine waits for it. Returns the words.
pub(crate) fn guest() -> Result<Vec<u8>, Failure> {
    // A run that is to tell the names of objects, or messages of the validation layer, needs an instance with the extension for both.
    let (reads_names, validation) = (std::env::var_os(NAMES_VARIABLE).is_some(), validation());
    let tells = reads_names || validation != ValidationMode::Off;
    let extensions: &[&CStr] = if tells { &[ash::ext::debug_utils::NAME] } else { &[] };
    let engine = instance(extensions, validation)?;
    // SAFETY: the instance is alive.
    let devices = unsafe { engine.raw.enumerate_physical_devices() }
        .map_err(in_call("vkEnumeratePhysicalDevices", "instance"))?;
    let physical = *devices.first().ok_or("no device")?;
    let desc = ContextDesc { debug_names: reads_names.then_some(true), validation, ..Default::default() };
    // SAFETY: the handles belong together, and are destroyed after the context and all that it made.
    unsafe {
        let needs = Context::requirements(&engine.entry, &engine.raw, extensions, physical, &desc)?;
        let (queues, mut chain) = (needs.queue_create_infos(), needs.feature_chain());
        let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues);
        let info = chain.merge_into(info)?;
        let raw =
            engine.raw.create_device(physical, &info, None).map_err(in_call("vkCreateDevice", "device"))?;
        let device = EngineDevice { raw };
        let done = EngineSemaphore::new(&device.raw)?;
        let ctx = Context::from_raw(needs.raw_context(device.raw.clone(), needs.queues(&device.raw)), &desc)?;
        let words = step(&ctx, &device.raw, done.raw);
        let idle = ctx.wait_idle();
        drop(ctx);
        let words = words?;
        idle?;
        Ok(words)
    }
}

fn instance(extensions: &[&CStr], validation: ValidationMode) -> Result<EngineInstance, Failure> {
    let driver = prepare(&driver_request(validation))?;
    let layers: &[_] =
        if validation == ValidationMode::Off { &[] } else { &[c"VK_LAYER_KHRONOS_validation".as_ptr()] };
    let version = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
    let extensions: Vec<_> = extensions.iter().map(|name| name.as_ptr()).collect();
    let info = vk::InstanceCreateInfo::default()
        .application_info(&version)
        .enabled_extension_names(&extensions)
        .enabled_layer_names(layers);
    // SAFETY: the library is a Vulkan loader, and the description is valid.
    unsafe {
        let entry = match &driver.loader {
            Some(path) => ash::Entry::load_from(path)?,
            None => ash::Entry::load()?,
        };
        let raw = entry.create_instance(&info, None).map_err(in_call("vkCreateInstance", "instance"))?;
        Ok(EngineInstance { entry, raw })
    }
}

fn step(ctx: &Context, device: &ash::Device, done: vk::Semaphore) -> Result<Vec<u8>, Failure> {
    let pipeline = step_pipeline(ctx)?;
    let (from, to) = (words_buffer(ctx, 5)?, words_buffer(ctx, 0)?);
    let mut cmd = ctx.acquire_command_buffer()?;
    record_step(ctx, &mut cmd, *pipeline, [*from, *to], 9)?;
    // SAFETY: the semaphore is of this device, and its value was 0.
    unsafe { ctx.submit_with(cmd, &[], &[RawSignal { semaphore: done, value: 1 }])? };
    let semaphores = [done];
    let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&[1]);
    // SAFETY: the semaphore is alive.
    unsafe { device.wait_semaphores(&info, u64::MAX) }.map_err(in_call("vkWaitSemaphores", "semaphore"))?;
    Ok(read_words(ctx, *to)?)
}
