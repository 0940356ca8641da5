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

/// The ways to the same picture.
const WAYS: [&str; 4] = ["driver's pipeline", "lowered", "lowered to queries", "by hand"];

/// Milliseconds of a frame.
#[derive(Debug, Clone, Copy)]
struct FrameTimes {
    /// Time from the begin of the first pass to the end of the last, on the GPU; with submission and wait for the triangle.
    frame: f64,
    /// Time of the passes that trace rays.
    rays: f64,
}

/// Renders the frame with a number.
type Frames = Box<dyn FnMut(u32) -> Result<FrameTimes, BenchError>>;

/// A sample: its name, and a function that creates it for a path and a picture of this width and height.
type SampleRow = (&'static str, fn(&Context, RayPath, [u32; 2]) -> Result<Frames, BenchError>);

const SAMPLES: [SampleRow; 5] = [
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
    let lowered = setup.open_tracing(Software, RayQueryRequest::Off, None)?;
    let onto_queries = match setup.open_tracing(Query, RayQueryRequest::Off, None) {
        Err(BenchError::Device(lvk::Error::NoDevice { .. })) => None,
        opened => Some(opened?),
    };
    let by_hand = setup.open_tracing(Off, RayQueryRequest::Software, None)?;
    let size = setup.image_size(&driver, args);
    let runs = setup.runs(&driver, DefaultBy { quick: 1, cpu: 9, gpu: 60 });
    let what = format!("lowered ray tracing pipelines, {}x{}", size[0], size[1]);
    let columns = ["", WAYS[0], WAYS[1], WAYS[2], WAYS[3], "lowered / driver's", "lowered / by hand"];
    let mut table = Table::new(setup.title(&driver, &what), &columns);
    let has_driver = driver.capabilities().ray_tracing_pipeline;
    if !has_driver {
        let device = &driver.capabilities().device_name;
        table.add_note(format!("the driver's pipelines not measured: {device} has none"));
    }
    if onto_queries.is_none() {
        let device = &driver.capabilities().device_name;
        table.add_note(format!("pipelines lowered to ray queries not measured: {device} has none"));
    }
    // A smoke test does with two: the others take the same way.
    let count = setup.default_for(&driver, DefaultBy { quick: 2, cpu: SAMPLES.len(), gpu: SAMPLES.len() });
    for (name, make) in SAMPLES.into_iter().take(count) {
        let mut ways =
            vec![(1, make(&lowered, RayPath::Pipeline, size)?), (3, make(&by_hand, RayPath::Query, size)?)];
        if let Some(ctx) = &onto_queries {
            ways.push((2, make(ctx, RayPath::Pipeline, size)?));
        }
        if has_driver {
            ways.push((0, make(&driver, RayPath::Pipeline, size)?));
        }
        add_rows(&mut table, name, runs, &mut ways, true)?;
    }
    let mut ways = vec![(1, triangle::frames(&lowered)?)];
    if let Some(ctx) = &onto_queries {
        ways.push((2, triangle::frames(ctx)?));
    }
    if has_driver {
        ways.push((0, triangle::frames(&driver)?));
    }
    add_rows(&mut table, "triangle, 640x480, until done", runs, &mut ways, false)?;
    table.add_note(format!("GPU times, medians of {runs} interleaved frames, each followed by a wait"));
    table.add_note("lowered: to the library's own traversal, as in both ratios");
    table.add_note("until done: from the acquisition of the command buffer until the GPU is done");
    Ok(table)
}

/// Measures the ways, each with its column, and adds a row for the frame, and one for its rays where other passes take time too.
fn add_rows(
    table: &mut Table,
    name: &str,
    runs: u32,
    ways: &mut [(usize, Frames)],
    has_passes: bool,
) -> Result<(), BenchError> {
    let mut counts = [0; WAYS.len()];
    let samples = interleave_all(ways.len(), runs, |way| {
        let (column, render) = &mut ways[way];
        counts[*column] += 1;
        render(counts[*column])
    })?;
    let medians = |of: fn(&FrameTimes) -> f64| {
        let mut cells = [None; WAYS.len()];
        for ((column, _), samples) in ways.iter().zip(&samples) {
            cells[*column] = Some(median_of(samples, of));
        }
        cells
    };
    add_row(table, name.to_owned(), medians(|times| times.frame));
    if has_passes {
        add_row(table, format!("{name}, rays"), medians(|times| times.rays));
    }
    Ok(())
}

fn add_row(table: &mut Table, name: String, medians: [Option<f64>; WAYS.len()]) {
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
    Box::new(move |frame| {
        sample.update(FrameTime::from_frame(frame, ROUND));
        let times = headless::render(&mut sample, &mut |_| {})?.times;
        let traces = |name: &str| name.contains("ray");
        let rays = times.passes().filter(|(name, _)| traces(name)).map(|(_, ms)| ms).sum();
        Ok(FrameTimes { frame: times.span_ms(), rays })
    })
}
