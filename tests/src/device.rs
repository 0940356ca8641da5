//! A context for a test. Its drop fails the test if the validation layer sent a message.

use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

use lvk::ash::{Entry, vk};
use lvk::test_hooks::{observe_values_once, with_unordered_queues};
use lvk::{
    Context, ContextDesc, Error, QueueRequest, RayQueryRequest, RayTracingPipelineRequest, ValidationMode,
    ValidationSink,
};
use lvk_dev_driver::{DriverError, DriverRequest, is_set, prepare, radv_icd, swiftshader_icd};

/// A context under core and synchronization validation. Its drop fails the test on any message, those of the
/// context's destruction included.
pub struct TestDevice {
    context: Option<Context>,
    sink: ValidationSink,
}

impl TestDevice {
    /// Takes the messages that a test provoked on purpose.
    pub fn take_messages(&self) -> Vec<lvk::ValidationMessage> {
        self.sink.take()
    }

    /// Returns the bare context, whose drop does not wait, and the messages, which the caller has to check.
    pub fn into_context(mut self) -> (Option<Context>, ValidationSink) {
        (self.context.take(), self.sink.clone())
    }
}

impl Deref for TestDevice {
    type Target = Context;

    fn deref(&self) -> &Context {
        match &self.context {
            Some(context) => context,
            None => unreachable!("the context is only taken by drop"),
        }
    }
}

impl Drop for TestDevice {
    fn drop(&mut self) {
        let mut faults = Vec::new();
        if let Some(context) = self.context.take() {
            let _ = context.wait_idle();
            if is_set("LVK_TEST_CHECK_INDICES") {
                faults = context.index_faults().unwrap_or_default();
            }
        }
        if std::thread::panicking() {
            return;
        }
        assert!(faults.is_empty(), "shaders use wrong indices: {faults:#?}");
        let messages: Vec<String> = self.sink.take().iter().map(ToString::to_string).collect();
        assert!(messages.is_empty(), "the validation layer is not silent:\n{}", messages.join("\n"));
    }
}

/// Creates a context with every optional feature. See [`device_with`].
pub fn device() -> Option<TestDevice> {
    device_with(|_| {})
}

/// Creates a context from a description that `adjust` has changed. Pipelines that are to be lowered onto ray queries are
/// those of the device if it has no queries.
///
/// Returns `None`, and prints a line, only if there is no device and the user set `LVK_SKIP_GPU_TESTS=1`.
/// `LVK_REQUIRE_GPU=1` forbids even that.
///
/// # Panics
/// When there is no device, or the context cannot be made.
pub fn device_with<'a>(adjust: impl FnOnce(&mut ContextDesc<'a>)) -> Option<TestDevice> {
    let library = vulkan()?;
    let sink = ValidationSink::default();
    let mut desc = ContextDesc {
        application_name: "lvk tests",
        vulkan_library: library,
        validation: validation(),
        validation_sink: Some(sink.clone()),
        ray_query: ray_query(),
        ray_tracing_pipeline: ray_tracing_pipeline(),
        check_indices: is_set("LVK_TEST_CHECK_INDICES"),
        ..Default::default()
    };
    adjust(&mut desc);
    let seed = unordered_queues();
    if seed.is_some() && desc.queues == QueueRequest::OwnHardware {
        desc.queues = QueueRequest::Emulated;
    }
    let new = |desc: &ContextDesc<'_>| match seed {
        Some(seed) => with_unordered_queues(seed, || Context::new(desc)),
        None => Context::new(desc),
    };
    let made = match new(&desc) {
        Err(Error::NoDevice { .. }) if desc.ray_tracing_pipeline == RayTracingPipelineRequest::Query => {
            desc.ray_tracing_pipeline = RayTracingPipelineRequest::HardwareIfPresent;
            new(&desc)
        }
        made => made,
    };
    match made {
        Ok(context) => Some(TestDevice { context: Some(context), sink }),
        Err(error) => unavailable(&error.to_string()),
    }
}

/// As [`device_with`], without software BVHs, whatever `LVK_TEST_RAY_QUERY` and `LVK_TEST_RAY_PIPELINE` say: for tests of
/// the driver's memory and time.
pub fn without_software<'a>(adjust: impl FnOnce(&mut ContextDesc<'a>)) -> Option<TestDevice> {
    device_with(|desc| {
        desc.ray_query = RayQueryRequest::HardwareIfPresent;
        desc.ray_tracing_pipeline = RayTracingPipelineRequest::HardwareIfPresent;
        adjust(desc);
    })
}

/// Returns the implementation of ray queries for tests that do not choose one: the device's where it has them, or the
/// value of `LVK_TEST_RAY_QUERY` (`hardware`, `software`, `auto`).
fn ray_query() -> RayQueryRequest {
    match std::env::var("LVK_TEST_RAY_QUERY").as_deref() {
        Ok("software") => RayQueryRequest::Software,
        Ok("auto") => RayQueryRequest::Auto,
        _ => RayQueryRequest::HardwareIfPresent,
    }
}

/// Returns the implementation of ray tracing pipelines for tests that do not choose one: the device's where it has them,
/// or the value of `LVK_TEST_RAY_PIPELINE` (`hardware`, `query`, `software`).
fn ray_tracing_pipeline() -> RayTracingPipelineRequest {
    match std::env::var("LVK_TEST_RAY_PIPELINE").as_deref() {
        Ok("query") => RayTracingPipelineRequest::Query,
        Ok("software") => RayTracingPipelineRequest::Software,
        _ => RayTracingPipelineRequest::HardwareIfPresent,
    }
}

/// Returns a seed for queues that run late and in a random order, if `LVK_TEST_QUEUES` is `unordered`: another one for each context.
fn unordered_queues() -> Option<u64> {
    static COUNT: AtomicU64 = AtomicU64::new(1);
    let is_wanted = std::env::var("LVK_TEST_QUEUES").is_ok_and(|value| value == "unordered");
    is_wanted.then(|| COUNT.fetch_add(1, Ordering::Relaxed).wrapping_mul(0x9e37_79b9_7f4a_7c15))
}

/// Returns the value of `LVK_TEST_VALIDATION`: `gpu`, `off`, or core and synchronization validation.
fn validation() -> ValidationMode {
    match std::env::var("LVK_TEST_VALIDATION").as_deref() {
        Ok("gpu") => ValidationMode::GpuAssisted,
        Ok("off") => ValidationMode::Off,
        _ => ValidationMode::Standard,
    }
}

/// Returns the Vulkan loader to open, `Some(None)` for the system's own; `None` as for [`device_with`].
///
/// # Panics
/// When there is no driver.
pub fn vulkan() -> Option<Option<&'static Path>> {
    observe_values_once();
    match loader() {
        Ok(loader) => Some(loader.library.as_deref()),
        Err(reason) if is_set("LVK_SKIP_GPU_TESTS") && !is_set("LVK_REQUIRE_GPU") => {
            eprintln!("SKIPPED, no Vulkan device: {reason}");
            None
        }
        Err(reason) => unavailable(reason),
    }
}

/// True if the driver computes NaN bounds around primitives beside inactive ones, so that rays miss them, as lavapipe
/// 25.0 does. Prints a line if so.
pub fn loses_neighbours_of_inactive(ctx: &Context) -> bool {
    let name = &ctx.capabilities().device_name;
    let loses = name.contains("llvmpipe");
    if loses {
        eprintln!("NOT TESTED, {name} loses primitives beside inactive ones");
    }
    loses
}

/// True if the driver draws to windows of an X server without a screen. NVIDIA's (580.159.04) makes no swapchain there, and
/// ends the process when it is asked whether it presents to a server without GLX. Prints a line if it does not.
#[cfg_attr(not(target_os = "linux"), allow(dead_code, reason = "windows of tests are those of X servers"))]
pub(crate) fn draws_to_virtual_displays() -> bool {
    let draws = !loader().is_ok_and(|loader| loader.has_nvidia);
    if !draws {
        eprintln!("NOT TESTED, NVIDIA's driver does not draw to an X server without a screen");
    }
    draws
}

/// Returns the driver manifest of SwiftShader, a device without ray tracing. Prints a line and returns `None` where
/// it cannot be fetched.
///
/// # Panics
/// When it cannot be fetched although `LVK_REQUIRE_GPU=1` demands every test.
pub fn swiftshader() -> Option<PathBuf> {
    fetched(swiftshader_icd(), "device without ray tracing")
}

/// Returns the driver manifest of RADV, for AMD GPUs, with its libraries open in this process. Prints a line and
/// returns `None` where it cannot be fetched.
///
/// # Panics
/// As [`swiftshader`].
pub fn radv() -> Option<PathBuf> {
    fetched(radv_icd(), "driver for AMD cards")
}

/// Returns the fetched driver. Prints a line and returns `None` where it cannot be fetched.
///
/// # Panics
/// As [`swiftshader`].
pub(crate) fn fetched<T>(found: Result<T, DriverError>, what: &str) -> Option<T> {
    match found {
        Ok(found) => Some(found),
        Err(error) if is_set("LVK_REQUIRE_GPU") => unavailable(&error.to_string()),
        Err(error) => {
            eprintln!("SKIPPED, no {what}: {error}");
            None
        }
    }
}

/// The Vulkan loader to open, and what tests must know of its drivers.
struct Loader {
    /// `None` for the system's own.
    library: Option<PathBuf>,
    #[cfg_attr(
        not(target_os = "linux"),
        allow(dead_code, reason = "windows of tests are those of X servers")
    )]
    has_nvidia: bool,
}

/// Returns the Vulkan loader to open, found or fetched once.
fn loader() -> Result<&'static Loader, &'static str> {
    static LOADER: OnceLock<Result<Loader, String>> = OnceLock::new();
    let found = LOADER.get_or_init(|| {
        let validation = !matches!(validation(), ValidationMode::Off);
        let request = DriverRequest { validation, quick_compilation: true };
        let driver = prepare(&request).map_err(|error| error.to_string())?;
        let has_nvidia = keep_drivers(driver.loader.as_deref()).contains(&vk::DriverId::NVIDIA_PROPRIETARY);
        Ok(Loader { library: driver.loader, has_nvidia })
    });
    found.as_ref().map_err(String::as_str)
}

/// Keeps the drivers loaded until the process ends, by an instance that is never destroyed: a process can load
/// NVIDIA's driver only some thirty times. Without a driver the first context reports the error. Returns the drivers of
/// the devices.
fn keep_drivers(library: Option<&Path>) -> Vec<vk::DriverId> {
    // SAFETY: the library is a Vulkan loader, and stays open.
    let entry = unsafe { library.map_or_else(|| Entry::load(), |path| Entry::load_from(path)) };
    let Ok(entry) = entry else { return Vec::new() };
    let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
    let info = vk::InstanceCreateInfo::default().application_info(&application);
    // SAFETY: the description is valid, and the entry is kept with the instance.
    let Ok(instance) = (unsafe { entry.create_instance(&info, None) }) else { return Vec::new() };
    let driver_of = |device| {
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
        // SAFETY: the device belongs to the instance. One without Vulkan 1.2 leaves the structure as it is.
        unsafe { instance.get_physical_device_properties2(device, &mut properties) };
        driver.driver_id
    };
    // SAFETY: the instance is alive. Drivers are loaded by then.
    let devices = unsafe { instance.enumerate_physical_devices() }.unwrap_or_default();
    let drivers = devices.into_iter().map(driver_of).collect();
    std::mem::forget((entry, instance));
    drivers
}

#[expect(clippy::panic, reason = "a test without its device has failed")]
pub(crate) fn unavailable(reason: &str) -> ! {
    panic!("this test needs a Vulkan device: {reason}");
}
