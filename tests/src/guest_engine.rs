//! An engine that creates its device by the requirements of a context, in plain Vulkan, under the validation layer.
#![expect(clippy::unwrap_used, reason = "a test whose set-up fails has failed")]

use std::ffi::{CStr, c_void};
use std::sync::Mutex;

use lvk::ash::{self, vk};
use lvk::{Context, ContextDesc, DeviceRequirements, RawContext};

use crate::device::vulkan;

/// Messages of the validation layer, which the messenger writes to.
type Messages = Mutex<Vec<String>>;

/// An instance and a device with the requirements of a context and nothing else. Its drop fails the test on any message
/// of the validation layer.
pub struct GuestEngine {
    /// The requirements that the device was created with.
    pub requirements: DeviceRequirements<'static>,
    /// The device.
    pub device: ash::Device,
    queues: [(vk::Queue, u32); 3],
    instance: GuestInstance,
}

/// An instance with a messenger.
pub struct GuestInstance {
    /// The loader.
    pub entry: ash::Entry,
    /// The instance.
    pub raw: ash::Instance,
    /// The extensions that are on.
    pub extensions: &'static [&'static CStr],
    messenger: Option<(ash::ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    messages: Box<Messages>,
}

impl GuestInstance {
    /// Creates an instance with the requirements of `desc`. `None`, loudly, without a driver.
    pub fn new(desc: &ContextDesc<'_>) -> Option<Self> {
        let library = vulkan()?;
        // SAFETY: plain Vulkan, as the layer confirms. The library is a Vulkan loader.
        unsafe {
            let entry = match library {
                Some(path) => ash::Entry::load_from(path).unwrap(),
                None => ash::Entry::load().unwrap(),
            };
            let validated = std::env::var("LVK_TEST_VALIDATION").as_deref() != Ok("off");
            let mut extensions = Context::instance_requirements(&entry, desc).unwrap();
            extensions.extend(validated.then_some(ash::ext::debug_utils::NAME));
            let names: Vec<_> = extensions.iter().map(|name| name.as_ptr()).collect();
            let layers = [c"VK_LAYER_KHRONOS_validation".as_ptr()];
            let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
            let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
            let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
            let mut info = vk::InstanceCreateInfo::default()
                .application_info(&application)
                .enabled_extension_names(&names);
            if validated {
                info = info.enabled_layer_names(&layers).push_next(&mut features);
            }
            let raw = entry.create_instance(&info, None).unwrap();
            let messages = Box::new(Messages::default());
            let messenger = validated.then(|| {
                use vk::DebugUtilsMessageSeverityFlagsEXT as Severity;
                let ext = ash::ext::debug_utils::Instance::new(&entry, &raw);
                let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
                    .message_severity(Severity::ERROR | Severity::WARNING)
                    .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION)
                    .pfn_user_callback(Some(on_message))
                    .user_data((&raw const *messages).cast_mut().cast());
                let messenger = ext.create_debug_utils_messenger(&info, None).unwrap();
                (ext, messenger)
            });
            Some(Self { entry, raw, extensions: extensions.leak(), messenger, messages })
        }
    }

    /// Returns the first device.
    pub fn physical_device(&self) -> vk::PhysicalDevice {
        // SAFETY: the instance is alive.
        unsafe { self.raw.enumerate_physical_devices() }.unwrap()[0]
    }

    /// Returns what a context with `desc` needs of the first device.
    pub fn requirements(&self, desc: &ContextDesc<'_>) -> lvk::Result<DeviceRequirements<'static>> {
        // SAFETY: all of it belongs together and outlives the requirements, which tests drop first.
        unsafe {
            Context::requirements(&self.entry, &self.raw, self.extensions, self.physical_device(), desc)
        }
    }
}

impl GuestInstance {
    /// Takes the messages that a test provoked on purpose.
    pub fn take_messages(&self) -> Vec<String> {
        std::mem::take(&mut *self.messages.lock().unwrap())
    }
}

impl Drop for GuestInstance {
    fn drop(&mut self) {
        // SAFETY: devices and surfaces are gone.
        unsafe {
            if let Some((ext, messenger)) = self.messenger.take() {
                ext.destroy_debug_utils_messenger(messenger, None);
            }
            self.raw.destroy_instance(None);
        }
        let messages = std::mem::take(&mut *self.messages.lock().unwrap());
        if !std::thread::panicking() {
            assert_eq!(messages, [""; 0], "the validation layer is not silent");
        }
    }
}

impl GuestEngine {
    /// Creates a device with the requirements of `desc`. `None`, loudly, without a driver.
    pub fn new(desc: &ContextDesc<'_>) -> Option<Self> {
        let instance = GuestInstance::new(desc)?;
        let requirements = instance.requirements(desc).unwrap();
        Some(Self::with_requirements(instance, requirements, vk::DeviceCreateInfo::default()))
    }

    /// Creates a device with these requirements merged into `info`, which is valid for the device.
    pub fn with_requirements(
        instance: GuestInstance,
        requirements: DeviceRequirements<'static>,
        info: vk::DeviceCreateInfo<'_>,
    ) -> Self {
        let queues = requirements.queue_create_infos();
        let mut chain = requirements.feature_chain();
        // SAFETY: plain Vulkan, as the layer confirms; every structure lives until the device is created.
        let device = unsafe {
            let info = chain.merge_into(info.queue_create_infos(&queues)).unwrap();
            instance.raw.create_device(instance.physical_device(), &info, None).unwrap()
        };
        // SAFETY: the device has these queues.
        let queues = unsafe { requirements.queues(&device) };
        Self { requirements, device, queues, instance }
    }

    /// Returns the description of the device.
    pub fn raw(&self) -> RawContext<'_> {
        self.requirements.raw_context(self.device.clone(), self.queues)
    }

    /// Creates a context on the device.
    pub fn context(&self, desc: &ContextDesc<'_>) -> Context {
        // SAFETY: the device has the requirements on, and tests drop contexts before the engine.
        unsafe { Context::from_raw(self.raw(), desc) }.unwrap()
    }

    /// Returns the instance.
    pub fn instance(&self) -> &GuestInstance {
        &self.instance
    }
}

impl Drop for GuestEngine {
    fn drop(&mut self) {
        // SAFETY: contexts and objects are gone.
        unsafe { self.device.destroy_device(None) };
    }
}

unsafe extern "system" fn on_message(
    _: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    messages: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: Vulkan gives a valid structure with a text, and the messages live until the messenger is destroyed.
    let (text, messages) =
        unsafe { (CStr::from_ptr((*data).p_message).to_string_lossy(), &*messages.cast::<Messages>()) };
    if !text.contains("vkGetDeviceProcAddr")
        && !text.contains("Setting")
        && let Ok(mut messages) = messages.lock()
    {
        messages.push(text.into_owned());
    }
    vk::FALSE
}
