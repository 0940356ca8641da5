//! The sample on the command line: scene in, pictures and timings out.

use std::fmt::Write as _;
use std::process::ExitCode;

use lvk::{Capabilities, Context};

use super::args::{self, HybridArgs};
use super::sequence::HybridSequence;
use super::texture_fit::{fit_textures, textures_needed};
use super::{
    Bounces, Geometry, HybridConfig, HybridError, HybridRenderer, Method, Raster, RasterTuning, RayPath,
};
use crate::app::cli::{self, ReadySample, SampleSetup};
use crate::app::device::{DeviceNeeds, device_text, query_text};
use crate::app::frames::Frames;
use crate::app::print_line;
use crate::app::run_error::RunError;
use crate::scene::Scene;

/// What the sample and its pictures are called.
const NAME: &str = "hybrid";

impl From<HybridError> for RunError {
    fn from(error: HybridError) -> Self {
        match error {
            HybridError::BadSize { .. }
            | HybridError::TooDeep { .. }
            | HybridError::BadSamples { .. }
            | HybridError::NothingFirst
            | HybridError::TooManyTriangles { .. }
            | HybridError::TooManyTextures { .. }
            | HybridError::BrokenScene(_) => Self::input(error),
            _ => Self::device(error),
        }
    }
}

/// Does what the command line says. Prints to standard output, errors in one line to standard error; the status
/// is 0 when the pictures were written, 1 for trouble with the device, 2 for wrong input, 130 after Ctrl-C.
#[must_use]
pub fn run(args: &HybridArgs) -> ExitCode {
    match args.scene.list.listing() {
        Some(listing) => {
            print_line(&listing);
            ExitCode::SUCCESS
        }
        None => cli::run_with(NAME, &args.run, |setup| open(args, setup)),
    }
}

fn open(args: &HybridArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<HybridSequence>, RunError> {
    args.scene.check_out(&args.run.out_or(NAME))?;
    let mut scene = args.scene.load(&mut setup.progress)?;
    setup.warn(&scene.warnings);
    let tracing = DeviceNeeds::tracing(args.tracing.rt);
    let context = setup.device(&DeviceNeeds { textures: textures_needed(&scene), ..tracing })?;
    let path = RayPath::choose(RayPath::from_args(args.tracing.rt), context.capabilities())?;
    let wish = wished_method(args);
    let method = Method::choose(wish, context.capabilities());
    if wish.is_none() && method == Method::Standalone {
        setup.warn(&[stand_in(context.capabilities())]);
    }
    let config = config(args, method, path);
    let warnings = fit_textures(&mut scene, &context.capabilities().limits)?;
    setup.warn(&warnings);
    setup.progress.stage("uploading the scene and building acceleration structures", 0);
    let mut renderer = HybridRenderer::new(&context, &scene, &config)?;
    let mut summary = summary(&context, &scene, &config, &renderer);
    let first = args.scene.camera.index();
    // A sequence needs no telling which rasteriser would be faster.
    if !matches!(args.run.frames, Some(Frames::Sequence(_)))
        && let Some(choice) = renderer.choose_raster(&scene.cameras[first])?
    {
        let _ = write!(summary, "\ngeometry  {choice}");
    }
    let sample = HybridSequence::new(renderer, &scene, first, args.lamp == args::Lamp::Circle);
    Ok(ReadySample { sample, summary })
}

/// The method that is named, if only by something that it alone has.
fn wished_method(args: &HybridArgs) -> Option<Method> {
    let names_hybrid = args.gbuffer == args::GBuffer::Paper
        || args.raster != args::Raster::Auto
        || args.bounces == args::Bounces::First;
    match args.method {
        Some(args::Method::Standalone) => Some(Method::Standalone),
        Some(args::Method::Hybrid) => Some(Method::Hybrid),
        None => names_hybrid.then_some(Method::Hybrid),
    }
}

/// The notice that the usual method gives way.
fn stand_in(capabilities: &Capabilities) -> String {
    format!(
        "{} has neither 64-bit atomics nor triangle numbers in fragment shaders, one of which the hybrid method needs: \
         everything is traced, as by --method standalone",
        capabilities.device_name
    )
}

fn config(args: &HybridArgs, method: Method, path: RayPath) -> HybridConfig {
    let raster = match args.raster {
        args::Raster::Auto => None,
        args::Raster::Compute => Some(Raster::Compute),
        args::Raster::Hardware => Some(Raster::Hardware),
    };
    let geometry = match args.gbuffer {
        args::GBuffer::Paper => Geometry::Paper,
        args::GBuffer::Visibility => Geometry::Visibility(raster),
    };
    let usual = RasterTuning::default();
    let (small_pixels, medium_pixels) = (args.small_triangle, args.medium_triangle);
    let tuning = RasterTuning { small_pixels, medium_pixels, ..usual };
    let bounces = match args.bounces {
        args::Bounces::Auto => None,
        args::Bounces::Inline => Some(Bounces::Inline),
        args::Bounces::Queued => Some(Bounces::Queued),
        args::Bounces::First => Some(Bounces::First),
    };
    let (width, height, max_depth, samples) = (args.run.width, args.run.height, args.depth, args.samples);
    HybridConfig { method, path, width, height, max_depth, bounces, samples, geometry, tuning }
}

fn summary(ctx: &Context, scene: &Scene, config: &HybridConfig, renderer: &HybridRenderer) -> String {
    let capabilities = ctx.capabilities();
    let refractive = scene.triangles.len() - scene.opaque_triangle_count as usize;
    let method = match config.method {
        Method::Standalone => "stand-alone ray tracing",
        Method::Hybrid => match config.geometry {
            Geometry::Paper => "hybrid: the paper's G-buffer, then rays",
            Geometry::Visibility(_) => "hybrid: visible triangles, then rays",
        },
    };
    let path = match config.path {
        RayPath::Pipeline => "ray tracing pipeline",
        RayPath::Query => &query_text(capabilities, "a compute shader"),
    };
    let mut text = device_text(capabilities);
    let _ = write!(text, "method    {method}; {path}; depth {}", config.max_depth);
    let _ = match config.samples {
        1 => writeln!(text),
        samples => writeln!(text, "; {samples} samples"),
    };
    let _ = writeln!(
        text,
        "scene     {}: {} triangles, {refractive} of them refractive; {} materials, {} textures",
        scene.name,
        scene.triangles.len(),
        scene.materials.len(),
        scene.textures.len()
    );
    let _ = write!(text, "built     {} BLAS", renderer.blas_count());
    if renderer.blas_part_count() as usize > renderer.blas_count() {
        let _ = write!(text, ", split into {} parts,", renderer.blas_part_count());
    }
    let _ = write!(text, " in {:.1} ms", renderer.blas_build_ms());
    text
}
