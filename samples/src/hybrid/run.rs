//! The sample on the command line: scene in, pictures and timings out.

use std::fmt::Write as _;
use std::process::ExitCode;

use lvk::Context;

use super::sequence::HybridSequence;
use super::texture_fit::{fit_textures, textures_needed};
use super::{HybridConfig, HybridError, HybridRenderer, Method, RayPath};
use crate::app::args::{self, HybridArgs};
use crate::app::device::{DeviceNeeds, driver_text};
use crate::app::run::{self, Opened, Opening};
use crate::app::run_args::RayTracing;
use crate::app::run_error::RunError;
use crate::app::say;
use crate::scene::Scene;

/// What the sample and its pictures are called.
const NAME: &str = "hybrid";

impl From<HybridError> for RunError {
    fn from(error: HybridError) -> Self {
        match error {
            HybridError::BadSize { .. }
            | HybridError::TooDeep { .. }
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
    match args.scene.listing() {
        Some(listing) => {
            say(&listing);
            ExitCode::SUCCESS
        }
        None => run::run(NAME, &args.run, |opening| open(args, opening)),
    }
}

fn open(args: &HybridArgs, opening: &mut Opening<'_>) -> Result<Opened<HybridSequence>, RunError> {
    args.scene.check_out(&args.run.out_or(NAME))?;
    let mut scene = args.scene.load(&mut opening.progress)?;
    opening.warn(&scene.warnings);
    let context = opening.device(&DeviceNeeds { textures: textures_needed(&scene) })?;
    let path = RayPath::choose(wished_path(args.run.rt), context.capabilities())?;
    let config = config(args, path);
    let warnings = fit_textures(&mut scene, &context.capabilities().limits)?;
    opening.warn(&warnings);
    opening.progress.stage("uploading the scene and building acceleration structures", 0);
    let renderer = HybridRenderer::new(&context, &scene, &config)?;
    let headline = headline(&context, &scene, &config, &renderer);
    let first = (args.scene.camera as usize).clamp(1, 5) - 1;
    let sample = HybridSequence::new(renderer, &scene, first, args.lamp == args::Lamp::Circle);
    Ok(Opened { context, sample, headline })
}

fn wished_path(wish: RayTracing) -> Option<RayPath> {
    match wish {
        RayTracing::Auto => None,
        RayTracing::Pipeline => Some(RayPath::Pipeline),
        RayTracing::Query => Some(RayPath::Query),
    }
}

fn config(args: &HybridArgs, path: RayPath) -> HybridConfig {
    let method = match args.method {
        args::Method::Standalone => Method::Standalone,
        args::Method::Hybrid => Method::Hybrid,
    };
    HybridConfig { method, path, width: args.run.width, height: args.run.height, max_depth: args.depth }
}

fn headline(ctx: &Context, scene: &Scene, config: &HybridConfig, renderer: &HybridRenderer) -> String {
    let capabilities = ctx.capabilities();
    let refractive = scene.triangles.len() - scene.opaque_triangle_count as usize;
    let method = match config.method {
        Method::Standalone => "stand-alone ray tracing",
        Method::Hybrid => "hybrid: geometry pass, then rays",
    };
    let path = match config.path {
        RayPath::Pipeline => "ray tracing pipeline",
        RayPath::Query => "ray queries in a compute shader",
    };
    let mut text = format!("device    {} ({})\n", capabilities.device_name, driver_text(capabilities));
    if let Some(profile) = &capabilities.profile {
        let _ = writeln!(text, "profile   {profile}, rehearsed on this device");
    }
    let _ = writeln!(text, "method    {method}; {path}; depth {}", config.max_depth);
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
