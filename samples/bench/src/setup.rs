//! Opens the measured device, and selects default sizes for it.

use std::path::{Path, PathBuf};

use lvk::{
    Context, ContextDesc, DeviceProfile, QueueRequest, RayQueryRequest, RayTracingPipelineRequest,
    ValidationMode, ValidationSink,
};

use crate::args::{BenchArgs, Benchmark, ImageSizeArgs};
use crate::error::BenchError;
use lvk_dev_driver::{DriverRequest, prepare};
use lvk_samples::app::ray_args::RayTracing;
use lvk_samples::hybrid::RayPath;

/// Options that all benchmarks share, and the settings to open the device.
pub(super) struct Setup {
    loader: Option<PathBuf>,
    device: Option<String>,
    profile: DeviceProfile,
    /// Implementation of ray queries: the driver's, unless the software implementation is measured.
    ray_query: RayQueryRequest,
    queues: QueueRequest,
    runs: Option<u32>,
    quick: bool,
    /// Receives validation messages; `None` without validation.
    sink: Option<ValidationSink>,
}

/// Default values for a smoke test, for a driver on the CPU, and for a GPU.
#[derive(Debug, Clone, Copy)]
pub(super) struct DefaultBy<T> {
    pub(super) quick: T,
    pub(super) cpu: T,
    pub(super) gpu: T,
}

impl Setup {
    pub(super) fn new(args: &BenchArgs) -> Result<Self, BenchError> {
        let driver = prepare(&DriverRequest { validation: args.validate, ..DriverRequest::default() })?;
        Ok(Self {
            loader: driver.loader,
            device: args.device.clone(),
            profile: args.profile.clone().unwrap_or_default(),
            ray_query: ray_query_request(args.benchmark.as_ref()),
            queues: if args.single_queue { QueueRequest::Shared } else { QueueRequest::default() },
            runs: args.runs,
            quick: args.quick,
            sink: args.validate.then(ValidationSink::default),
        })
    }

    /// Opens the device that the command line selects.
    pub(super) fn open(&self) -> Result<Context, BenchError> {
        self.open_with(ContextDesc::default().scratch_budget_bytes)
    }

    /// Opens the device with command functions that do nothing.
    pub(super) fn open_null_device(&self) -> Result<Context, BenchError> {
        Ok(lvk::test_hooks::null_command_context(&self.desc(&self.profile))?)
    }

    /// Opens the device with this scratch budget.
    pub(super) fn open_with(&self, scratch_budget_bytes: u64) -> Result<Context, BenchError> {
        self.open_profile(scratch_budget_bytes, &self.profile, 0)
    }

    /// Opens the device with at least `textures` texture slots.
    pub(super) fn open_for_textures(&self, textures: u32) -> Result<Context, BenchError> {
        self.open_profile(ContextDesc::default().scratch_budget_bytes, &self.profile, textures)
    }

    /// Opens the device with at most `max_blas_primitives` primitives per BLAS.
    pub(super) fn open_limited(&self, max_blas_primitives: u64) -> Result<Context, BenchError> {
        let max_blas_primitives = max_blas_primitives.min(self.profile.max_blas_primitives);
        let profile = DeviceProfile { max_blas_primitives, ..self.profile.clone() };
        self.open_profile(ContextDesc::default().scratch_budget_bytes, &profile, 0)
    }

    /// Opens the device with these requests for ray tracing pipelines and ray queries, and with this folder as BVH cache.
    pub(super) fn open_tracing(
        &self,
        ray_tracing_pipeline: RayTracingPipelineRequest,
        ray_query: RayQueryRequest,
        tree_cache: Option<&Path>,
    ) -> Result<Context, BenchError> {
        let desc = self.desc(&self.profile);
        Ok(Context::new(&ContextDesc { ray_tracing_pipeline, ray_query, tree_cache, ..desc })?)
    }

    fn open_profile(
        &self,
        scratch_budget_bytes: u64,
        profile: &DeviceProfile,
        textures: u32,
    ) -> Result<Context, BenchError> {
        let max_textures = textures.max(ContextDesc::default().max_textures);
        Ok(Context::new(&ContextDesc { scratch_budget_bytes, max_textures, ..self.desc(profile) })?)
    }

    fn desc<'a>(&'a self, profile: &'a DeviceProfile) -> ContextDesc<'a> {
        ContextDesc {
            application_name: "bench",
            vulkan_library: self.loader.as_deref(),
            device: self.device.as_deref(),
            ray_query: self.ray_query,
            ray_tracing_pipeline: self.pipeline(),
            queues: self.queues,
            validation: if self.sink.is_some() { ValidationMode::Standard } else { ValidationMode::Off },
            validation_sink: self.sink.clone(),
            profile: Some(profile).filter(|profile| **profile != DeviceProfile::default()),
            ..ContextDesc::default()
        }
    }

    /// Disables ray tracing pipelines beside software ray queries: the driver's acceleration structures would be unused.
    fn pipeline(&self) -> RayTracingPipelineRequest {
        match self.ray_query {
            RayQueryRequest::Software => RayTracingPipelineRequest::Off,
            _ => RayTracingPipelineRequest::HardwareIfPresent,
        }
    }

    /// Takes the validation messages. Drop all contexts first, as their destruction is validated, too.
    pub(super) fn validation_messages(&self) -> Vec<String> {
        self.sink.iter().flat_map(ValidationSink::take).map(|message| message.to_string()).collect()
    }

    /// Returns the default value for the device.
    pub(super) fn default_for<T>(&self, ctx: &Context, choice: DefaultBy<T>) -> T {
        match (self.quick, ctx.capabilities().is_cpu) {
            (true, _) => choice.quick,
            (false, true) => choice.cpu,
            (false, false) => choice.gpu,
        }
    }

    /// Returns the number of runs: the user's, or the default for the device.
    pub(super) fn runs(&self, ctx: &Context, choice: DefaultBy<u32>) -> u32 {
        self.runs.unwrap_or_else(|| self.default_for(ctx, choice))
    }

    /// Returns the image size: the user's, or the default for the device.
    pub(super) fn image_size(&self, ctx: &Context, args: &ImageSizeArgs) -> [u32; 2] {
        let [width, height] =
            self.default_for(ctx, DefaultBy { quick: [32, 18], cpu: [160, 90], gpu: [1280, 720] });
        [args.width.unwrap_or(width), args.height.unwrap_or(height)]
    }

    /// True if times are not meaningful, because sizes are tiny or validation is on.
    pub(super) fn is_smoke_test(&self) -> bool {
        self.quick || self.sink.is_some()
    }

    /// Returns the title of a table about `what`, with device and driver.
    pub(super) fn title(&self, ctx: &Context, what: &str) -> String {
        let caps = ctx.capabilities();
        let (major, minor, patch) = caps.api_version;
        let driver = format!("{} {}", caps.driver_name, caps.driver_info);
        let quick = if self.is_smoke_test() { " (smoke test: times are not meaningful)" } else { "" };
        let profile = caps.profile.as_ref().map_or_else(String::new, |name| format!(", as {name}"));
        let driver = driver.trim_end();
        format!("## {what}{quick}\n\n{}{profile}; {driver}, Vulkan {major}.{minor}.{patch}", caps.device_name)
    }
}

fn ray_query_request(benchmark: Option<&Benchmark>) -> RayQueryRequest {
    match benchmark {
        Some(Benchmark::Paper(paper)) if paper.rt == RayTracing::Software => RayQueryRequest::Software,
        _ => RayQueryRequest::HardwareIfPresent,
    }
}

/// Returns the ray tracing paths of the device, at least one, and a note on the missing path.
///
/// # Errors
/// [`BenchError::NoRayTracing`].
pub(super) fn ray_paths(ctx: &Context) -> Result<(Vec<RayPath>, Option<String>), BenchError> {
    let caps = ctx.capabilities();
    let device = caps.device_name.clone();
    match (caps.ray_tracing_pipeline, caps.ray_query) {
        (true, true) => Ok((vec![RayPath::Pipeline, RayPath::Query], None)),
        (true, false) => {
            Ok((vec![RayPath::Pipeline], Some(format!("ray queries not measured: {device} has none"))))
        }
        (false, true) => {
            Ok((vec![RayPath::Query], Some(format!("ray tracing pipelines not measured: {device} has none"))))
        }
        (false, false) => Err(BenchError::NoRayTracing { device }),
    }
}

/// Returns the name of a path for tables.
pub(super) fn path_name(path: RayPath) -> &'static str {
    match path {
        RayPath::Pipeline => "pipeline",
        RayPath::Query => "query",
    }
}
