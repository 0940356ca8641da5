//! Frames of samples by ray tracing pipelines of the driver, by lowered ones on both paths, and by the samples' own ray queries in software.

mod triangle;

use lvk::{Context, RayQueryRequest, RayTracingPipelineRequest};
use lvk_samples::app::headless;
use lvk_samples::app::run_error::RunError;
use lvk_samples::app::sample::{FrameTime, Sample};
use lvk_samples::hybrid::{HybridConfig, HybridRenderer, HybridSequence, Method, RayPath};
use lvk_samples::reflections::{Reflections, ReflectionsConfig};
use lvk_samples::rtx::RtxConfig;
use lvk_samples::rtx_hello::RtxHello;
use lvk_samples::rtx_pipeline::{RtxPipeline, RtxPipelineConfig};
use lvk_samples::scene::Scene;

use crate::args::ImageSizeArgs;
use crate::error::BenchError;
use crate::measure::{interleave_all, median_of};
use crate::setup::{DefaultBy, Setup};
use crate::table::{Table, format_ms, format_ratio};

/// Frames in which the camera of a sample goes round.
const ROUND: u32 = 60;

/// The ways to the same picture, each a column of the table.
const WAYS: [&str; 4] = ["driver's pipeline", "lowered", "lowered to queries", "by hand"];

/// For each of [`WAYS`] the context and the path of the sample; `None` where the device has no such way.
type Ways = [Option<(Context, RayPath)>; WAYS.len()];

/// Milliseconds of a frame.
#[derive(Debug, Clone, Copy)]
struct FrameTimes {
    /// Time from the begin of the first pass to the end of the last, on the GPU; with submission and wait for the triangle.
    frame: f64,
    /// Time of the passes that trace rays.
    rays: f64,
}

/// Renders the next frame.
type Frames = Box<dyn FnMut() -> Result<FrameTimes, BenchError>>;

/// Creates a sample for a path and a picture of this width and height.
type Make = fn(&Context, RayPath, [u32; 2]) -> Result<Frames, BenchError>;

const SAMPLES: [(&str, Make); 5] = [
    ("hybrid", |ctx, path, size| hybrid(ctx, path, size, Method::Hybrid)),
    ("rtx_hello", |ctx, path, [width, height]| {
        Ok(frames(RtxHello::new(ctx, &RtxConfig { path, width, height }).map_err(RunError::from)?))
    }),
    ("hybrid --method standalone", |ctx, path, size| hybrid(ctx, path, size, Method::Standalone)),
    ("reflections --samples 1", |ctx, path, [width, height]| {
        let config = ReflectionsConfig { samples: 1, ..ReflectionsConfig::new(path, width, height) };
        Ok(frames(Reflections::new(ctx, &config).map_err(RunError::from)?))
    }),
    ("rtx_pipeline", |ctx, path, [width, height]| {
        let config = RtxPipelineConfig::new(RtxConfig { path, width, height });
        Ok(frames(RtxPipeline::new(ctx, &Scene::procedural(), &config).map_err(RunError::from)?))
    }),
];

/// Compares the frames of each sample, interleaved. Ratios are of pipelines that are lowered to software. The triangle has no ray queries by hand.
pub(super) fn measure(setup: &Setup, args: &ImageSizeArgs) -> Result<Table, BenchError> {
    use RayTracingPipelineRequest::{HardwareIfPresent, Off, Query, Software};
    let driver = setup.open_tracing(HardwareIfPresent, RayQueryRequest::Off, None)?;
    let onto_queries = match setup.open_tracing(Query, RayQueryRequest::Off, None) {
        Err(BenchError::Device(lvk::Error::NoDevice { .. })) => None,
        opened => Some(opened?),
    };
    let size = setup.image_size(&driver, args);
    let runs = setup.runs(&driver, DefaultBy { quick: 1, cpu: 9, gpu: 60 });
    // A smoke test does with two: the others take the same way.
    let count = setup.default_for(&driver, DefaultBy { quick: 2, cpu: SAMPLES.len(), gpu: SAMPLES.len() });
    let what = format!("lowered ray tracing pipelines, {}x{}", size[0], size[1]);
    let columns = ["", WAYS[0], WAYS[1], WAYS[2], WAYS[3], "lowered / driver's", "lowered / by hand"];
    let mut table = Table::new(setup.title(&driver, &what), &columns);
    let device = driver.capabilities().device_name.clone();
    let mut ways = [
        Some(driver).filter(|ctx| ctx.capabilities().ray_tracing_pipeline).map(by_pipeline),
        Some(by_pipeline(setup.open_tracing(Software, RayQueryRequest::Off, None)?)),
        onto_queries.map(by_pipeline),
        Some((setup.open_tracing(Off, RayQueryRequest::Software, None)?, RayPath::Query)),
    ];
    for (way, what) in ways.iter().zip(["the driver's pipelines", "", "pipelines lowered to ray queries", ""])
    {
        if way.is_none() {
            table.add_note(format!("{what} not measured: {device} has none"));
        }
    }
    for (name, make) in SAMPLES.into_iter().take(count) {
        let [frame, rays] = medians(&ways, make, size, runs)?;
        add_row(&mut table, name.to_owned(), frame);
        add_row(&mut table, format!("{name}, rays"), rays);
    }
    // The triangle has no version by hand.
    ways[3] = None;
    let [until_done, _] = medians(&ways, |ctx, _, _| triangle::frames(ctx), size, runs)?;
    add_row(&mut table, "triangle, 640x480, until done".to_owned(), until_done);
    table.add_note(format!("GPU times, medians of {runs} interleaved frames, each followed by a wait"));
    table.add_note("lowered: to the library's own traversal, as in both ratios");
    table.add_note("until done: from the acquisition of the command buffer until the GPU is done");
    Ok(table)
}

fn by_pipeline(ctx: Context) -> (Context, RayPath) {
    (ctx, RayPath::Pipeline)
}

/// A time by each of [`WAYS`].
type Times = [Option<f64>; WAYS.len()];

/// Returns the median times of the frame and of its rays.
fn medians(ways: &Ways, make: Make, size: [u32; 2], runs: u32) -> Result<[Times; 2], BenchError> {
    let mut samples = Vec::new();
    for (column, way) in ways.iter().enumerate() {
        if let Some((ctx, path)) = way {
            samples.push((column, make(ctx, *path, size)?));
        }
    }
    let measured = interleave_all(samples.len(), runs, |sample| (samples[sample].1)())?;
    let mut medians = [Times::default(); 2];
    for ((column, _), times) in samples.iter().zip(measured) {
        medians[0][*column] = Some(median_of(&times, |times| times.frame));
        medians[1][*column] = Some(median_of(&times, |times| times.rays));
    }
    Ok(medians)
}

fn add_row(table: &mut Table, name: String, medians: Times) {
    let ratio = |to: Option<f64>| {
        medians[1].zip(to).map(|(ours, other)| format_ratio(ours / other)).unwrap_or_default()
    };
    let ratios = [ratio(medians[0]), ratio(medians[3])];
    let times = medians.map(|ms| ms.map(format_ms).unwrap_or_default());
    table.add_row(name, times.into_iter().chain(ratios));
}

fn hybrid(
    ctx: &Context,
    path: RayPath,
    [width, height]: [u32; 2],
    method: Method,
) -> Result<Frames, BenchError> {
    let scene = Scene::procedural();
    let config = HybridConfig { path, method, width, height, ..HybridConfig::default() };
    let renderer = HybridRenderer::new(ctx, &scene, &config).map_err(RunError::from)?;
    Ok(frames(HybridSequence::new(renderer, &scene, 0, false)))
}

/// Returns the frames of a sample that is set up.
fn frames<S: Sample + 'static>(mut sample: S) -> Frames {
    let mut frame = 0;
    Box::new(move || {
        frame += 1;
        sample.update(FrameTime::from_frame(frame, ROUND));
        let times = headless::render(&mut sample, &mut |_| {})?.times;
        let traces = |name: &str| name.contains("ray");
        let rays = times.passes().filter(|(name, _)| traces(name)).map(|(_, ms)| ms).sum();
        Ok(FrameTimes { frame: times.span_ms(), rays })
    })
}
