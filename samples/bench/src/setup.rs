//! The device to measure, and how much to measure on it.

use std::path::{Path, PathBuf};

use lvk::{
    Context, ContextDesc, DeviceProfile, FeatureRequest, RayQueryRequest, ValidationMode, ValidationSink,
};

use super::args::{BenchArgs, Benchmark, PictureArgs};
use super::error::BenchError;
use lvk_dev_driver::{DriverRequest, prepare};
use lvk_samples::app::ray_args::RayTracing;
use lvk_samples::hybrid::RayPath;

/// How to open the device, and what the command line says to all benchmarks.
pub(super) struct Setup {
    loader: Option<PathBuf>,
    device: Option<String>,
    profile: DeviceProfile,
    /// Who walks the trees of ray queries: the driver, unless software is to be measured.
    ray_query: RayQueryRequest,
    runs: Option<u32>,
    quick: bool,
    /// Where messages go, if the validation layer is to run.
    sink: Option<ValidationSink>,
}

/// Values for a smoke test, for a driver on the CPU, and for a GPU.
#[derive(Debug, Clone, Copy)]
pub(super) struct Choice<T> {
    pub(super) quick: T,
    pub(super) cpu: T,
    pub(super) gpu: T,
}

impl Setup {
    pub(super) fn new(args: &BenchArgs) -> Result<Self, BenchError> {
        let driver = prepare(&DriverRequest { validation: args.validate })?;
        Ok(Self {
            loader: driver.loader,
            device: args.device.clone(),
            profile: args.profile.clone().unwrap_or_default(),
            ray_query: ray_query(args.benchmark.as_ref()),
            runs: args.runs,
            quick: args.quick,
            sink: args.validate.then(ValidationSink::default),
        })
    }

    /// The device, as the command line has it.
    pub(super) fn open(&self) -> Result<Context, BenchError> {
        self.open_with(ContextDesc::default().scratch_budget_bytes)
    }

    /// The same, but what is recorded does nothing.
    pub(super) fn open_silent(&self) -> Result<Context, BenchError> {
        Ok(lvk::test_hooks::silent_context(&self.desc(&self.profile))?)
    }

    /// The same with this budget for scratch memory.
    pub(super) fn open_with(&self, scratch_budget_bytes: u64) -> Result<Context, BenchError> {
        self.open_profile(scratch_budget_bytes, &self.profile, 0)
    }

    /// The device with room for so many textures at least.
    pub(super) fn open_for_textures(&self, textures: u32) -> Result<Context, BenchError> {
        self.open_profile(ContextDesc::default().scratch_budget_bytes, &self.profile, textures)
    }

    /// The same with at most so many primitives in a structure.
    pub(super) fn open_limited(&self, max_blas_primitives: u64) -> Result<Context, BenchError> {
        let max_blas_primitives = max_blas_primitives.min(self.profile.max_blas_primitives);
        let profile = DeviceProfile { max_blas_primitives, ..self.profile.clone() };
        self.open_profile(ContextDesc::default().scratch_budget_bytes, &profile, 0)
    }

    /// The device with pipelines as asked for, ray queries by whom, and built trees kept in this folder.
    pub(super) fn open_tracing(
        &self,
        ray_tracing_pipeline: FeatureRequest,
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
            validation: if self.sink.is_some() { ValidationMode::Standard } else { ValidationMode::Off },
            validation_sink: self.sink.clone(),
            profile: Some(profile).filter(|profile| **profile != DeviceProfile::default()),
            ..ContextDesc::default()
        }
    }

    /// None beside queries in software: the device's own structures would be built for nothing.
    fn pipeline(&self) -> FeatureRequest {
        match self.ray_query {
            RayQueryRequest::Software => FeatureRequest::Off,
            _ => ContextDesc::default().ray_tracing_pipeline,
        }
    }

    /// What the validation layer said so far; contexts should be gone, as their end is checked too.
    pub(super) fn validation_messages(&self) -> Vec<String> {
        self.sink.iter().flat_map(ValidationSink::take).map(|message| message.to_string()).collect()
    }

    /// What suits the device.
    pub(super) fn choose<T>(&self, ctx: &Context, choice: Choice<T>) -> T {
        match (self.quick, ctx.capabilities().is_cpu) {
            (true, _) => choice.quick,
            (false, true) => choice.cpu,
            (false, false) => choice.gpu,
        }
    }

    /// Runs of each measurement: as the user says, else what suits the device.
    pub(super) fn runs(&self, ctx: &Context, choice: Choice<u32>) -> u32 {
        self.runs.unwrap_or_else(|| self.choose(ctx, choice))
    }

    /// Width and height of pictures: as the user says, else what suits the device.
    pub(super) fn picture_size(&self, ctx: &Context, args: &PictureArgs) -> [u32; 2] {
        let [width, height] = self.choose(ctx, Choice { quick: [32, 18], cpu: [160, 90], gpu: [1280, 720] });
        [args.width.unwrap_or(width), args.height.unwrap_or(height)]
    }

    /// Whether figures mean little, because sizes are tiny or the validation layer is at work.
    pub(super) fn is_rehearsal(&self) -> bool {
        self.quick || self.sink.is_some()
    }

    /// The title of a table about `what`.
    pub(super) fn headline(&self, ctx: &Context, what: &str) -> String {
        let caps = ctx.capabilities();
        let (major, minor, patch) = caps.api_version;
        let driver = format!("{} {}", caps.driver_name, caps.driver_info);
        let quick = if self.is_rehearsal() { " (a rehearsal: the figures mean little)" } else { "" };
        let profile = caps.profile.as_ref().map_or_else(String::new, |name| format!(", as {name}"));
        let driver = driver.trim_end();
        format!("## {what}{quick}\n\n{}{profile}; {driver}, Vulkan {major}.{minor}.{patch}", caps.device_name)
    }
}

fn ray_query(benchmark: Option<&Benchmark>) -> RayQueryRequest {
    match benchmark {
        Some(Benchmark::Paper(paper)) if paper.rt == RayTracing::Software => RayQueryRequest::Software,
        _ => RayQueryRequest::HardwareIfPresent,
    }
}

/// By what the device can trace rays, never nothing, and a note on what it cannot.
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

/// For tables.
pub(super) fn path_name(path: RayPath) -> &'static str {
    match path {
        RayPath::Pipeline => "pipeline",
        RayPath::Query => "query",
    }
}
