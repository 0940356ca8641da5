//! The device to measure, and how much to measure on it.

use std::path::PathBuf;

use lvk::{Context, ContextDesc, DeviceProfile};

use super::args::{BenchArgs, TraceArgs};
use super::error::BenchError;
use crate::driver::{DriverRequest, prepare};
use crate::hybrid::RayPath;

/// How to open the device, and what the command line says to all benchmarks.
pub(super) struct Setup {
    loader: Option<PathBuf>,
    device: Option<String>,
    runs: Option<u32>,
    quick: bool,
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
        let driver = prepare(&DriverRequest::default())?;
        Ok(Self { loader: driver.loader, device: args.device.clone(), runs: args.runs, quick: args.quick })
    }

    /// The device as it is.
    pub(super) fn open(&self) -> Result<Context, BenchError> {
        self.open_with(ContextDesc::default().scratch_budget_bytes, None)
    }

    /// The device with this budget for scratch memory, under a profile.
    pub(super) fn open_with(
        &self,
        scratch_budget_bytes: u64,
        profile: Option<&DeviceProfile>,
    ) -> Result<Context, BenchError> {
        Ok(Context::new(&ContextDesc {
            application_name: "bench",
            vulkan_library: self.loader.as_deref(),
            device: self.device.as_deref(),
            scratch_budget_bytes,
            profile,
            ..ContextDesc::default()
        })?)
    }

    /// The device with room for so many textures.
    pub(super) fn open_for_textures(&self, textures: u32) -> Result<Context, BenchError> {
        Ok(Context::new(&ContextDesc {
            application_name: "bench",
            vulkan_library: self.loader.as_deref(),
            device: self.device.as_deref(),
            max_textures: textures.max(ContextDesc::default().max_textures),
            ..ContextDesc::default()
        })?)
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
    pub(super) fn picture_size(&self, ctx: &Context, args: &TraceArgs) -> [u32; 2] {
        let [width, height] = self.choose(ctx, Choice { quick: [32, 18], cpu: [160, 90], gpu: [1280, 720] });
        [args.width.unwrap_or(width), args.height.unwrap_or(height)]
    }

    /// What to say beside figures of a smoke test.
    pub(super) fn quick_remark(&self) -> &'static str {
        if self.quick { " (quick: the figures mean little)" } else { "" }
    }

    /// The title of a table about `what`.
    pub(super) fn headline(&self, ctx: &Context, what: &str) -> String {
        let caps = ctx.capabilities();
        let (major, minor, patch) = caps.api_version;
        let driver = format!("{} {}", caps.driver_name, caps.driver_info);
        let quick = self.quick_remark();
        format!(
            "## {what}{quick}\n\n{}; {}, Vulkan {major}.{minor}.{patch}",
            caps.device_name,
            driver.trim_end()
        )
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
