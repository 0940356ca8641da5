//! The sample on the command line: scene in, picture and timings out.

use std::fmt::Write as _;
use std::io::Write as _;
use std::process::ExitCode;

use lvk::{Capabilities, Context, ContextDesc, DeviceProfile, FeatureRequest, Validation, ValidationSink};

use super::texture_fit::{fit_textures, textures_needed};
use super::{Geometry, HybridConfig, HybridError, HybridRenderer, Method, Raster, RasterTuning, RayPath};
use crate::app::args::{self, HybridArgs};
use crate::app::png::{self, PngError};
use crate::app::progress::Progress;
use crate::app::timings::Timings;
use crate::driver::{self, Driver, DriverError, DriverRequest};
use crate::scene::{Camera, ObjOptions, Scene, SceneError};

/// Frames to time where none are asked for, on a GPU.
const GPU_FRAMES: u32 = 60;
/// Frames that a GPU renders before any is timed, so that its clocks are up.
const WARM_UP_FRAMES: u32 = 5;

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
enum RunError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Png(#[from] PngError),
    #[error(transparent)]
    Driver(#[from] DriverError),
    #[error(transparent)]
    Hybrid(#[from] HybridError),
    #[error("validation reported {0} messages")]
    Validation(usize),
}

impl From<lvk::Error> for RunError {
    fn from(error: lvk::Error) -> Self {
        Self::Hybrid(error.into())
    }
}

impl RunError {
    /// 2 when the user can mend it by other arguments or input, 1 for trouble with the device.
    fn status(&self) -> u8 {
        match self {
            Self::Scene(_) | Self::Png(_) | Self::Driver(DriverError::Variable { .. }) => 2,
            Self::Hybrid(
                HybridError::BadSize { .. }
                | HybridError::TooDeep { .. }
                | HybridError::TooManyTriangles { .. }
                | HybridError::TooManyTextures { .. }
                | HybridError::BrokenScene(_),
            ) => 2,
            Self::Driver(_) | Self::Hybrid(_) | Self::Validation(_) => 1,
        }
    }
}

/// Does what the command line says. Prints to standard output, errors in one line to standard error; the status
/// is 0 when the picture was written, 1 for trouble with the device, 2 for wrong input.
#[must_use]
pub fn run(args: &HybridArgs) -> ExitCode {
    match attempt(args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.status())
        }
    }
}

fn attempt(args: &HybridArgs) -> Result<(), RunError> {
    if args.list_devices {
        return list_devices(args.profile.as_ref());
    }
    check_out(args)?;
    let mut progress = Progress::visible();
    let mut scene = load(args, &mut progress)?;
    progress.pause();
    warn(&scene.warnings);
    let driver = driver::prepare(&DriverRequest { validation: args.validate.is_some() })?;
    let sink = ValidationSink::default();
    progress.stage("opening the device", 0);
    let ctx = open(args, &driver, &sink, textures_needed(&scene))?;
    let path = RayPath::choose(wished_path(args.rt), ctx.capabilities())?;
    let config = config(args, path);
    let warnings = fit_textures(&mut scene, &ctx.capabilities().limits)?;
    if !warnings.is_empty() {
        progress.pause();
        warn(&warnings);
    }
    progress.stage("uploading the scene and building acceleration structures", 0);
    let mut renderer = HybridRenderer::new(&ctx, &scene, &config)?;
    drop(progress);
    let choice = renderer.choose_raster(camera(args, &scene))?;
    say(&headline(&ctx, &scene, &config, &renderer));
    if let Some(choice) = choice {
        say(&format!("geometry  {choice}"));
    }
    let timings = render(args, &ctx, &scene, &mut renderer)?;
    let image = renderer.read_image()?;
    drop(renderer);
    ctx.wait_idle()?;
    drop(ctx);
    if args.validate.is_some() {
        report_validation(&sink)?;
    }
    png::write(&args.out, args.width, args.height, &image)?;
    say(&format!("{timings}\nwrote {}", args.out.display()));
    Ok(())
}

/// Refuses an output that is an input too or cannot be written.
fn check_out(args: &HybridArgs) -> Result<(), PngError> {
    for (option, input) in [("--scene", &args.scene), ("--cameras", &args.cameras)] {
        if let Some(input) = input {
            png::check_not_input(&args.out, option, input)?;
        }
    }
    png::check_writable(&args.out)
}

fn warn(warnings: &[String]) {
    for warning in warnings {
        eprintln!("warning: {warning}");
    }
}

fn load(args: &HybridArgs, progress: &mut Progress) -> Result<Scene, SceneError> {
    match &args.scene {
        None => {
            progress.stage("making the courtyard", 0);
            Ok(Scene::procedural())
        }
        Some(path) => {
            let options = ObjOptions { scale: args.scale, cameras: args.cameras.clone() };
            Scene::from_obj(path, &options, progress)
        }
    }
}

/// Opens the device the user names, or the best one; a better one without ray tracing gives way to one with.
fn open(args: &HybridArgs, driver: &Driver, sink: &ValidationSink, textures: u32) -> lvk::Result<Context> {
    use FeatureRequest::{Optional, Required};
    let with = |ray_tracing_pipeline, ray_query| {
        Context::new(&ContextDesc {
            application_name: "hybrid",
            vulkan_library: driver.loader.as_deref(),
            device: args.device.as_deref(),
            profile: args.profile.as_ref(),
            validation: validation(args.validate),
            validation_sink: args.validate.map(|_| sink.clone()),
            ray_tracing_pipeline,
            ray_query,
            max_textures: textures.max(ContextDesc::default().max_textures),
            ..ContextDesc::default()
        })
    };
    match args.rt {
        args::RayTracing::Pipeline => with(Required, Optional),
        args::RayTracing::Query => with(Optional, Required),
        args::RayTracing::Auto => {
            let best = with(Optional, Optional)?;
            let capabilities = best.capabilities();
            if capabilities.ray_tracing_pipeline || capabilities.ray_query {
                return Ok(best);
            }
            Ok(with(Required, Optional).or_else(|_| with(Optional, Required)).unwrap_or(best))
        }
    }
}

fn validation(wish: Option<args::Validation>) -> Validation {
    match wish {
        None => Validation::Off,
        Some(args::Validation::Core) => Validation::Standard,
        Some(args::Validation::Gpu) => Validation::GpuAssisted,
    }
}

fn wished_path(wish: args::RayTracing) -> Option<RayPath> {
    match wish {
        args::RayTracing::Auto => None,
        args::RayTracing::Pipeline => Some(RayPath::Pipeline),
        args::RayTracing::Query => Some(RayPath::Query),
    }
}

fn config(args: &HybridArgs, path: RayPath) -> HybridConfig {
    let method = match args.method {
        args::Method::Standalone => Method::Standalone,
        args::Method::Hybrid => Method::Hybrid,
    };
    let raster = match args.raster {
        args::Raster::Auto => None,
        args::Raster::Compute => Some(Raster::Compute),
        args::Raster::Hardware => Some(Raster::Hardware),
    };
    let geometry = match args.gbuffer {
        args::GBuffer::Paper => Geometry::Paper,
        args::GBuffer::Visibility => Geometry::Visibility(raster),
    };
    let tuning = RasterTuning { small_pixels: args.small_triangle, ..RasterTuning::default() };
    let (width, height, max_depth) = (args.width, args.height, args.depth);
    HybridConfig { method, path, width, height, max_depth, geometry, tuning }
}

fn headline(ctx: &Context, scene: &Scene, config: &HybridConfig, renderer: &HybridRenderer) -> String {
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

fn driver_text(capabilities: &Capabilities) -> String {
    let (major, minor, patch) = capabilities.api_version;
    let driver = format!("{} {}", capabilities.driver_name, capabilities.driver_info);
    format!("{}, Vulkan {major}.{minor}.{patch}", driver.trim_end())
}

fn camera<'a>(args: &HybridArgs, scene: &'a Scene) -> &'a Camera {
    &scene.cameras[(args.camera as usize).clamp(1, 5) - 1]
}

/// Renders the frames and times all but those of the warm-up.
fn render(
    args: &HybridArgs,
    ctx: &Context,
    scene: &Scene,
    renderer: &mut HybridRenderer,
) -> Result<Timings, HybridError> {
    let is_cpu = ctx.capabilities().is_cpu;
    let frames = u64::from(args.frames.unwrap_or(if is_cpu { 1 } else { GPU_FRAMES }));
    let warm_up = if is_cpu { 0 } else { u64::from(WARM_UP_FRAMES) };
    let camera = camera(args, scene);
    let bands = renderer.band_count();
    let mut progress = Progress::visible();
    progress.stage("rendering", (warm_up + frames) * bands);
    let mut timings = Timings::new();
    for frame in 0..warm_up + frames {
        let times = renderer.render_with(camera, &mut |band| progress.set(frame * bands + band))?;
        if let Some(counted) = frame.checked_sub(warm_up) {
            times.add_to(&mut timings, counted);
        }
    }
    Ok(timings)
}

fn report_validation(sink: &ValidationSink) -> Result<(), RunError> {
    let messages = sink.messages();
    for message in &messages {
        eprintln!("validation: {message}");
    }
    say(&format!("validation messages: {}", messages.len()));
    if messages.is_empty() { Ok(()) } else { Err(RunError::Validation(messages.len())) }
}

/// Prints to standard output. A reader that has gone, as that of `hybrid | head -1`, does not cost the picture.
fn say(text: &str) {
    let _ = writeln!(std::io::stdout(), "{text}");
}

fn list_devices(profile: Option<&DeviceProfile>) -> Result<(), RunError> {
    let driver = driver::prepare(&DriverRequest::default())?;
    for (number, mut device) in Context::devices(driver.loader.as_deref())?.into_iter().enumerate() {
        if let Some(profile) = profile {
            profile.apply(&mut device);
        }
        say(&device_line(number, &device));
    }
    Ok(())
}

fn device_line(number: usize, device: &Capabilities) -> String {
    let has = |has: bool| if has { "yes" } else { "no" };
    let Capabilities { device_name: name, ray_tracing_pipeline: pipeline, ray_query: query, .. } = device;
    let (driver, pipeline, query) = (driver_text(device), has(*pipeline), has(*query));
    format!("[{number}] {name} ({driver}): ray tracing pipeline {pipeline}, ray query {query}")
}
