//! A context for a test, whose end fails the test if the validation layer said anything.

use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use lvk::ash::{Entry, vk};
use lvk::{Context, ContextDesc, RayQueryRequest, ValidationMode, ValidationSink};
use lvk_dev_driver::{DriverError, DriverRequest, prepare, radv_icd, swiftshader_icd};

/// A context under core and synchronization validation. Dropping it fails the test on any message, those of the
/// context's own end included.
pub struct TestDevice {
    context: Option<Context>,
    sink: ValidationSink,
}

impl TestDevice {
    /// Takes the messages a test provoked on purpose.
    pub fn take_messages(&self) -> Vec<lvk::ValidationMessage> {
        self.sink.take()
    }

    /// The bare context, whose end waits for nothing, and the messages, which the caller has to check.
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

/// A context with everything optional on. See [`device_with`].
pub fn device() -> Option<TestDevice> {
    device_with(|_| {})
}

/// A context whose description `adjust` has changed.
///
/// `None`, with a line on standard error, only when the user asked with `LVK_SKIP_GPU_TESTS=1` to go on without a
/// device and there is none; `LVK_REQUIRE_GPU=1` forbids even that.
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
        check_indices: is_set("LVK_TEST_CHECK_INDICES"),
        ..Default::default()
    };
    adjust(&mut desc);
    match Context::new(&desc) {
        Ok(context) => Some(TestDevice { context: Some(context), sink }),
        Err(error) => unavailable(&error.to_string()),
    }
}

/// As [`device_with`], with no structures but the device's own, whatever `LVK_TEST_RAY_QUERY` says: for tests of what the
/// driver's take.
pub fn without_software<'a>(adjust: impl FnOnce(&mut ContextDesc<'a>)) -> Option<TestDevice> {
    device_with(|desc| {
        desc.ray_query = RayQueryRequest::HardwareIfPresent;
        adjust(desc);
    })
}

/// Who walks ray queries unless a test says otherwise: the device, where it can, or what `LVK_TEST_RAY_QUERY` says
/// (`hardware`, `software`, `auto`).
fn ray_query() -> RayQueryRequest {
    match std::env::var("LVK_TEST_RAY_QUERY").as_deref() {
        Ok("software") => RayQueryRequest::Software,
        Ok("auto") => RayQueryRequest::Auto,
        _ => RayQueryRequest::HardwareIfPresent,
    }
}

/// What `LVK_TEST_VALIDATION` says: `gpu`, `off`, or core and synchronization validation.
fn validation() -> ValidationMode {
    match std::env::var("LVK_TEST_VALIDATION").as_deref() {
        Ok("gpu") => ValidationMode::GpuAssisted,
        Ok("off") => ValidationMode::Off,
        _ => ValidationMode::Standard,
    }
}

/// The Vulkan loader to open, `Some(None)` for the system's own; `None` as for [`device_with`].
///
/// # Panics
/// When there is no driver.
pub fn vulkan() -> Option<Option<&'static Path>> {
    match loader() {
        Ok(library) => Some(library.as_deref()),
        Err(reason) if is_set("LVK_SKIP_GPU_TESTS") && !is_set("LVK_REQUIRE_GPU") => {
            eprintln!("SKIPPED, no Vulkan device: {reason}");
            None
        }
        Err(reason) => unavailable(reason),
    }
}

/// Whether the driver builds boxes that are not numbers around what lies beside inactive primitives, so that rays miss
/// it, as lavapipe 25.0 does. Says so on standard error.
pub fn loses_neighbours_of_inactive(ctx: &Context) -> bool {
    let name = &ctx.capabilities().device_name;
    let loses = name.contains("llvmpipe");
    if loses {
        eprintln!("NOT TESTED, {name} loses primitives beside inactive ones");
    }
    loses
}

/// The description file of the device without ray tracing; `None`, loudly, where it cannot be fetched.
///
/// # Panics
/// When it cannot be fetched although `LVK_REQUIRE_GPU=1` demands every test.
pub fn swiftshader() -> Option<PathBuf> {
    fetched(swiftshader_icd(), "device without ray tracing")
}

/// The description file of the driver for AMD cards, with its libraries open in this process; `None`, loudly, where it
/// cannot be fetched.
///
/// # Panics
/// As [`swiftshader`].
pub fn radv() -> Option<PathBuf> {
    fetched(radv_icd(), "driver for AMD cards")
}

/// What could be fetched; `None`, loudly, where it cannot be.
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

/// The Vulkan loader to open, found or fetched once.
fn loader() -> Result<&'static Option<PathBuf>, &'static str> {
    static LOADER: OnceLock<Result<Option<PathBuf>, String>> = OnceLock::new();
    let found = LOADER.get_or_init(|| {
        let driver = prepare(&DriverRequest { validation: true }).map_err(|error| error.to_string())?;
        keep_driver(driver.loader.as_deref());
        Ok(driver.loader)
    });
    found.as_ref().map_err(String::as_str)
}

/// Keeps the driver loaded as long as the process runs, by an instance that is never destroyed: NVIDIA's can be loaded some
/// thirty times by one, and no more. Where there is no driver, contexts say so.
fn keep_driver(library: Option<&Path>) {
    // SAFETY: the library is a Vulkan loader, and stays open.
    let entry = unsafe { library.map_or_else(|| Entry::load(), |path| Entry::load_from(path)) };
    let Ok(entry) = entry else { return };
    let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
    let info = vk::InstanceCreateInfo::default().application_info(&application);
    // SAFETY: the description is valid, and the entry is kept with the instance.
    if let Ok(instance) = unsafe { entry.create_instance(&info, None) } {
        // SAFETY: the instance is alive. Drivers are loaded by then.
        drop(unsafe { instance.enumerate_physical_devices() });
        std::mem::forget((entry, instance));
    }
}

#[expect(clippy::panic, reason = "a test without its device has failed")]
pub(crate) fn unavailable(reason: &str) -> ! {
    panic!("this test needs a Vulkan device: {reason}");
}

fn is_set(variable: &str) -> bool {
    std::env::var(variable).is_ok_and(|value| !value.is_empty() && value != "0")
}
