//! Opens the device that the user names, and lists all devices.

use std::sync::Arc;

use lvk::{
    Capabilities, Context, ContextDesc, DeviceCandidate, DeviceProfile, OptionalFeature, RayQueryPath,
    RayQueryRequest, RayTracingPipelinePath, RayTracingPipelineRequest, ValidationSink, WindowHandles,
    YuvConversion,
};

use super::caches::Caches;
use super::ray_args::RayTracing;
use super::run_args::{RunArgs, ValidationArg};
use super::run_error::RunError;
use super::{print_line, print_message};
use lvk_dev_driver::{self as driver, Driver, DriverError, DriverRequest};

/// Requirements of a sample on the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DeviceNeeds {
    /// The ray tracing path; `None` without rays.
    pub rays: Option<RayTracing>,
    /// Features that the sample cannot do without: only devices that have them all are considered.
    pub features: &'static [OptionalFeature],
    /// Places for textures; fewer than the library's default count as that.
    pub textures: u32,
    /// Conversions of textures in Y'CbCr; where there are none, the library's own.
    pub yuv: &'static [YuvConversion],
    /// True if `--rt auto` takes the pipelines of a GPU even where the library would lower them: measured to be faster where much
    /// is shaded between the rays of a path.
    pub prefers_device_pipelines: bool,
}

impl DeviceNeeds {
    /// Returns the needs of a sample that traces rays.
    #[must_use]
    pub fn tracing(wish: RayTracing) -> Self {
        Self { rays: Some(wish), ..Self::default() }
    }
}

/// Opens the device the user names, or the best one; where that is a CPU or has no ray tracing, rays, if any, are traced by
/// queries in software, and a pipeline that the user names is lowered to compute shaders. Messages of the validation layer,
/// where it is asked for, go into `sink`.
pub(super) fn open(
    name: &str,
    args: &RunArgs,
    driver: &Driver,
    sink: &ValidationSink,
    needs: &DeviceNeeds,
    window: Option<Arc<dyn WindowHandles>>,
) -> Result<Context, RunError> {
    use RayQueryRequest::{Hardware, Software};
    use RayTracingPipelineRequest::{HardwareIfPresent as PipelineIfPresent, Off};
    let caches = Caches::open(name, args);
    let with = |ray_tracing_pipeline, ray_query| {
        Context::new(&ContextDesc {
            application_name: name,
            vulkan_library: driver.loader.as_deref(),
            device: args.device.as_deref(),
            profile: args.profile.as_ref(),
            window: window.clone(),
            validation: validation(args.validate),
            validation_sink: args.validate.map(|_| sink.clone()),
            check_indices: args.check_indices,
            ray_tracing_pipeline,
            ray_query,
            required_features: needs.features,
            max_textures: needs.textures.max(ContextDesc::default().max_textures),
            yuv: if needs.yuv.is_empty() { &YuvConversion::DEFAULT } else { needs.yuv },
            ..Caches::desc(caches.as_ref())
        })
    };
    match needs.rays {
        None => Ok(with(Off, RayQueryRequest::Off)?),
        Some(RayTracing::Pipeline) => {
            let chosen = with(RayTracingPipelineRequest::Auto, RayQueryRequest::Off)?;
            note_lowering(chosen.capabilities());
            Ok(chosen)
        }
        Some(RayTracing::Hardware) => Ok(with(RayTracingPipelineRequest::Hardware, RayQueryRequest::Off)?),
        Some(RayTracing::Query) => with(PipelineIfPresent, Hardware).map_err(without_queries),
        Some(RayTracing::Software) => Ok(with(Off, Software)?),
        Some(RayTracing::Auto) => Ok(open_best(args, needs.prefers_device_pipelines, with)?),
    }
}

/// Opens the device for the best path: its own pipelines or queries, else queries in software. On GPUs without units for ray tracing
/// the library lowers pipelines. A profile rehearses the device's own paths, which keep no structures for software beside theirs.
fn open_best(
    args: &RunArgs,
    prefers_device_pipelines: bool,
    open: impl Fn(RayTracingPipelineRequest, RayQueryRequest) -> lvk::Result<Context>,
) -> lvk::Result<Context> {
    let best = open(RayTracingPipelineRequest::HardwareIfPresent, RayQueryRequest::HardwareIfPresent)?;
    let caps = best.capabilities();
    let can_trace = caps.ray_tracing_pipeline || caps.ray_query;
    let is_profiled = args.profile.is_some();
    let lowers = caps.prefers_lowered_pipelines && !prefers_device_pipelines;
    let chosen = if lowers && !is_profiled {
        open(RayTracingPipelineRequest::Auto, RayQueryRequest::Off)?
    } else if can_trace && (is_profiled || !caps.is_cpu) {
        best
    } else {
        open(RayTracingPipelineRequest::Off, RayQueryRequest::Auto)?
    };
    eprintln!("note: --rt auto takes {}", choice(chosen.capabilities()));
    Ok(chosen)
}

/// Notes on standard error where pipelines are lowered to compute shaders.
fn note_lowering(capabilities: &Capabilities) {
    if capabilities.ray_tracing_pipeline_path.is_lowered() {
        eprintln!("note: --rt pipeline takes a {}", pipeline_text(capabilities));
    }
}

/// Names the way that needs no queries of the device, if these are what it lacks.
fn without_queries(error: lvk::Error) -> RunError {
    match error {
        lvk::Error::NoDevice { problem, candidates, .. } if candidates.iter().any(lacks_ray_queries) => {
            let devices = candidates.iter().map(DeviceCandidate::to_string);
            let reasons: Vec<_> = problem.into_iter().chain(devices).collect();
            RunError::NoRayQueries { reasons: reasons.join("; ") }
        }
        error => error.into(),
    }
}

/// True if ray queries are missing, or hidden by a profile.
fn lacks_ray_queries(device: &DeviceCandidate) -> bool {
    device.missing.iter().any(|what| what.starts_with("ray queries"))
}

/// Describes the chosen path, and the reason.
fn choice(capabilities: &Capabilities) -> String {
    match (capabilities.ray_tracing_pipeline, capabilities.ray_query_path) {
        (true, _) if capabilities.ray_tracing_pipeline_path.is_lowered() => {
            format!("a {}", pipeline_text(capabilities))
        }
        (true, _) => "the ray tracing pipelines that the device has".to_owned(),
        (false, RayQueryPath::Hardware) => {
            "ray queries of the device, which has no ray tracing pipelines".to_owned()
        }
        (false, _) => format!("ray queries in software: {}", capabilities.ray_query_reason),
    }
}

/// Prints the devices, one per line, as `profile` limits them. Without a device that can be used, prints the report of loader,
/// drivers and devices; so it does below the software driver that takes their place.
///
/// # Errors
/// [`RunError`] for wrong variables, a damaged driver, and failures of Vulkan other than the lack of a device.
pub fn list(profile: Option<&DeviceProfile>) -> Result<(), RunError> {
    let driver = match driver::prepare(&DriverRequest::default()) {
        Ok(driver) => driver,
        Err(DriverError::NoDriver { system: Some(system), cause }) => {
            print_line(&format!("{system:#}\na software driver cannot be downloaded because {cause}"));
            return Ok(());
        }
        Err(DriverError::NoSystemLoader { report }) => {
            print_line(&format!("{report:#}"));
            return Ok(());
        }
        Err(error) => return Err(error.into()),
    };
    match Context::devices(driver.loader.as_deref()) {
        Ok(devices) => {
            for (number, device) in devices.into_iter().enumerate() {
                print_device(number, device, profile);
            }
        }
        Err(lvk::Error::NoVulkan { report }) => print_line(&format!("{report:#}")),
        Err(error) => return Err(error.into()),
    }
    if let Some(system) = driver.system {
        print_line(&format!("the system's own Vulkan, which cannot trace rays:\n{system:#}"));
    }
    Ok(())
}

fn print_device(number: usize, mut device: Capabilities, profile: Option<&DeviceProfile>) {
    if let Some(profile) = profile {
        profile.apply(&mut device);
    }
    print_line(&device_line(number, &device));
}

/// Describes the device for the log, in one or two lines with their ends.
#[must_use]
pub fn device_text(capabilities: &Capabilities) -> String {
    let text = format!("device    {} ({})\n", capabilities.device_name, driver_text(capabilities));
    match &capabilities.profile {
        Some(profile) => text + &format!("profile   {profile}, emulated on this device\n"),
        None => text,
    }
}

/// Name and version of a device's driver, and of its Vulkan.
#[must_use]
pub fn driver_text(capabilities: &Capabilities) -> String {
    let (major, minor, patch) = capabilities.api_version;
    let driver = format!("{} {}", capabilities.driver_name, capabilities.driver_info);
    format!("{}, Vulkan {major}.{minor}.{patch}", driver.trim_end())
}

/// Describes ray queries in `stages`, and the reason for software traversal.
#[must_use]
pub fn query_text(capabilities: &Capabilities, stages: &str) -> String {
    match capabilities.ray_query_path {
        RayQueryPath::Software => {
            format!("ray queries in {stages}, in software ({})", capabilities.ray_query_reason)
        }
        RayQueryPath::Hardware | RayQueryPath::None => format!("ray queries in {stages}"),
    }
}

/// Describes ray tracing pipelines, and the reason where they are lowered to compute shaders.
#[must_use]
pub fn pipeline_text(capabilities: &Capabilities) -> String {
    let reason = capabilities.ray_tracing_pipeline_reason;
    match capabilities.ray_tracing_pipeline_path {
        RayTracingPipelinePath::Query => {
            format!("ray tracing pipeline, lowered to ray queries in a compute shader ({reason})")
        }
        RayTracingPipelinePath::Software => {
            format!("ray tracing pipeline, lowered to software traversal in a compute shader ({reason})")
        }
        RayTracingPipelinePath::Hardware | RayTracingPipelinePath::None => "ray tracing pipeline".to_owned(),
    }
}

/// Fails when the validation layer was not silent. The messages are printed as they come ([`library_warnings`](super::library_warnings)).
pub(super) fn report_validation(sink: &ValidationSink) -> Result<(), RunError> {
    let count = sink.messages().len();
    print_line(&format!("validation messages: {count}"));
    if count == 0 { Ok(()) } else { Err(RunError::Validation(count)) }
}

/// Fails when shaders have used wrong indices of bindless arrays, or textures that commands do not declare. Each is printed.
pub(in crate::app) fn report_index_faults(context: &Context) -> Result<(), RunError> {
    let faults = context.index_faults()?;
    faults.iter().for_each(|fault| print_message("error", fault));
    print_line(&format!("index faults: {}", faults.len()));
    if faults.is_empty() { Ok(()) } else { Err(RunError::IndexFaults(faults.len())) }
}

fn validation(wish: Option<ValidationArg>) -> lvk::ValidationMode {
    match wish {
        None => lvk::ValidationMode::Off,
        Some(ValidationArg::Core) => lvk::ValidationMode::Standard,
        Some(ValidationArg::Gpu) => lvk::ValidationMode::GpuAssisted,
    }
}

fn device_line(number: usize, device: &Capabilities) -> String {
    let has = |has: bool| if has { "yes" } else { "no" };
    let Capabilities { device_name: name, ray_tracing_pipeline: pipeline, ray_query: query, .. } = device;
    let (driver, pipeline, query) = (driver_text(device), has(*pipeline), has(*query));
    format!("[{number}] {name} ({driver}): ray tracing pipeline {pipeline}, ray query {query}")
}
