//! The sample on the command line: frames in, pictures and timings out.

use std::io::Write as _;
use std::process::ExitCode;

use lvk::{Capabilities, Context, ContextDesc, FeatureRequest, Validation, ValidationSink};

use super::args::HybridOitArgs;
use super::{HybridOit, HybridOitConfig, HybridOitError, NodeUse, OitScene};
use crate::app::args;
use crate::app::png::{self, PngError};
use crate::app::progress::Progress;
use crate::app::timings::Timings;
use crate::driver::{self, Driver, DriverError, DriverRequest};
use crate::hybrid::RayPath;

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
enum RunError {
    #[error("{0}")]
    Arguments(String),
    #[error(transparent)]
    Png(#[from] PngError),
    #[error(transparent)]
    Driver(#[from] DriverError),
    #[error(transparent)]
    Sample(#[from] HybridOitError),
    #[error("validation reported {0} messages")]
    Validation(usize),
}

impl From<lvk::Error> for RunError {
    fn from(error: lvk::Error) -> Self {
        Self::Sample(error.into())
    }
}

impl RunError {
    /// 2 when the user can mend it by other arguments or input, 1 for trouble with the device.
    fn status(&self) -> u8 {
        match self {
            Self::Arguments(_) | Self::Png(_) | Self::Driver(DriverError::Variable { .. }) => 2,
            Self::Sample(
                HybridOitError::BadSize { .. }
                | HybridOitError::TooManyFragments { .. }
                | HybridOitError::OutOfRange { .. }
                | HybridOitError::BrokenScene(_),
            ) => 2,
            Self::Driver(_) | Self::Sample(_) | Self::Validation(_) => 1,
        }
    }
}

/// Does what the command line says. Prints to standard output, errors in one line to standard error; the status
/// is 0 when the pictures were written, 1 for trouble with the device, 2 for wrong input.
#[must_use]
pub fn run(args: &HybridOitArgs) -> ExitCode {
    match attempt(args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.status())
        }
    }
}

fn attempt(args: &HybridOitArgs) -> Result<(), RunError> {
    let driver = driver::prepare(&DriverRequest { validation: args.validate.is_some() })?;
    if args.list_devices {
        return list_devices(args, &driver);
    }
    for shot in args.shots().map_err(RunError::Arguments)? {
        png::check_writable(&shot.path)?;
    }
    let sink = ValidationSink::default();
    let ctx = open(args, &driver, &sink)?;
    let scene = OitScene::default();
    let config = config(args, &ctx)?;
    let mut sample = HybridOit::new(&ctx, &scene, &config)?;
    say(&headline(&ctx, &scene, &config));
    let (timings, nodes) = render(args, &mut sample)?;
    drop(sample);
    ctx.wait_idle()?;
    drop(ctx);
    if args.validate.is_some() {
        report_validation(&sink)?;
    }
    say(&format!("{timings}\nglass     {nodes}"));
    if nodes.lost() > 0 {
        eprintln!("warning: glass is missing in the picture: {nodes}");
    }
    Ok(())
}

/// Renders and writes all pictures; answers the timings and the use of nodes of the frame that asked for most.
fn render(args: &HybridOitArgs, sample: &mut HybridOit) -> Result<(Timings, NodeUse), RunError> {
    let shots = args.shots().map_err(RunError::Arguments)?;
    let mut progress = Progress::visible();
    progress.stage("rendering", shots.len() as u64);
    let (mut timings, mut most) = (Timings::new(), NodeUse::default());
    for (frame, shot) in (0..).zip(&shots) {
        sample.update(shot.seconds);
        for (pass, milliseconds) in sample.render()? {
            timings.push(frame, pass, milliseconds);
        }
        let nodes = sample.node_use()?;
        most = if nodes.asked >= most.asked { nodes } else { most };
        png::write(&shot.path, args.width, args.height, &sample.picture()?)?;
        progress.set(frame + 1);
    }
    Ok((timings, most))
}

fn config(args: &HybridOitArgs, ctx: &Context) -> Result<HybridOitConfig, HybridOitError> {
    let wish = match args.rt {
        args::RayTracing::Auto => None,
        args::RayTracing::Pipeline => Some(RayPath::Pipeline),
        args::RayTracing::Query => Some(RayPath::Query),
    };
    let path = RayPath::choose(wish, ctx.capabilities())?;
    Ok(HybridOitConfig {
        supersampling: args.supersampling,
        shadow_rays: args.shadow_rays,
        node_capacity: args.nodes,
        ..HybridOitConfig::new(path, args.width, args.height)
    })
}

/// Opens the device the user names, or the best; a better one without ray tracing gives way to one with.
fn open(args: &HybridOitArgs, driver: &Driver, sink: &ValidationSink) -> lvk::Result<Context> {
    use FeatureRequest::{Optional, Required};
    let with = |ray_tracing_pipeline, ray_query| {
        Context::new(&ContextDesc {
            application_name: "hybrid_oit",
            vulkan_library: driver.loader.as_deref(),
            device: args.device.as_deref(),
            profile: args.profile.as_ref(),
            validation: match args.validate {
                None => Validation::Off,
                Some(args::Validation::Core) => Validation::Standard,
                Some(args::Validation::Gpu) => Validation::GpuAssisted,
            },
            validation_sink: args.validate.map(|_| sink.clone()),
            ray_tracing_pipeline,
            ray_query,
            ..ContextDesc::default()
        })
    };
    match args.rt {
        args::RayTracing::Pipeline => with(Required, Optional),
        args::RayTracing::Query => with(Optional, Required),
        args::RayTracing::Auto => with(Required, Optional).or_else(|_| with(Optional, Required)),
    }
}

fn headline(ctx: &Context, scene: &OitScene, config: &HybridOitConfig) -> String {
    let capabilities = ctx.capabilities();
    let path = match config.path {
        RayPath::Pipeline => "ray tracing pipeline with any-hit shader",
        RayPath::Query => "ray queries in a compute shader",
    };
    let profile = capabilities.profile.as_ref();
    let profile =
        profile.map_or_else(String::new, |name| format!("\nprofile   {name}, rehearsed on this device"));
    format!(
        "device    {} ({}){profile}\nmethod    raster with per-pixel lists of glass; shadows by {path}\nscene     {} \
         blocks, {} balls, {} spheres of glass; {} samples a pixel, {} shadow rays each",
        capabilities.device_name,
        driver_text(capabilities),
        scene.blocks.len(),
        scene.balls.len(),
        scene.glass.len(),
        config.supersampling * config.supersampling,
        config.shadow_rays
    )
}

fn driver_text(capabilities: &Capabilities) -> String {
    let (major, minor, patch) = capabilities.api_version;
    let driver = format!("{} {}", capabilities.driver_name, capabilities.driver_info);
    format!("{}, Vulkan {major}.{minor}.{patch}", driver.trim_end())
}

fn report_validation(sink: &ValidationSink) -> Result<(), RunError> {
    let messages = sink.messages();
    for message in &messages {
        eprintln!("validation: {message}");
    }
    say(&format!("validation messages: {}", messages.len()));
    if messages.is_empty() { Ok(()) } else { Err(RunError::Validation(messages.len())) }
}

/// Prints to standard output. A reader that has gone does not cost the picture.
fn say(text: &str) {
    let _ = writeln!(std::io::stdout(), "{text}");
}

fn list_devices(args: &HybridOitArgs, driver: &Driver) -> Result<(), RunError> {
    for (number, mut device) in Context::devices(driver.loader.as_deref())?.into_iter().enumerate() {
        if let Some(profile) = &args.profile {
            profile.apply(&mut device);
        }
        let has = |has: bool| if has { "yes" } else { "no" };
        let (pipeline, query) = (has(device.ray_tracing_pipeline), has(device.ray_query));
        let (name, driver) = (&device.device_name, driver_text(&device));
        say(&format!("[{number}] {name} ({driver}): ray tracing pipeline {pipeline}, ray query {query}"));
    }
    Ok(())
}
