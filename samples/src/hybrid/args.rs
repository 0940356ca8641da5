//! The sample's own arguments.

use clap::{Args, ValueEnum};

use crate::app::ray_args::RayArgs;
use crate::app::scene_args::SceneArgs;
use crate::app::value_parsers::whole;

/// Largest number of bounces.
pub const MAX_DEPTH: u32 = 16;
/// Largest number of samples.
pub const MAX_SAMPLES: u32 = 256;

/// Arguments of the sample.
#[derive(Debug, Clone, PartialEq, Args)]
#[command(next_help_heading = "Rendering")]
pub struct HybridArgs {
    /// The scene and its camera
    #[command(flatten)]
    pub scene: SceneArgs,

    /// Method that finds the visible surfaces [default: hybrid if the device supports it, else standalone]
    #[arg(long, value_enum)]
    pub method: Option<MethodArg>,

    /// Data that the hybrid method's geometry pass writes for the rays
    #[arg(long, value_enum, default_value_t = GBufferArg::Visibility)]
    pub gbuffer: GBufferArg,

    /// Rasteriser of visible triangles
    #[arg(long, value_enum, default_value_t = RasterArg::Auto)]
    pub raster: RasterArg,

    /// Maximum pixels of a triangle that one thread of the compute rasteriser draws, for tuning
    #[arg(long, value_name = "PIXELS", hide = true)]
    pub small_triangle: Option<u32>,

    /// Maximum pixels of a triangle that several threads draw together, for tuning
    #[arg(long, value_name = "PIXELS", hide = true)]
    pub medium_triangle: Option<u32>,

    /// Maximum number of reflections and refractions of a ray, 0 to 16; 0 gives shadows only
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = whole(0..=MAX_DEPTH))]
    pub depth: u32,

    /// Launch that traces the rays of mirrors and glass; the picture is the same
    #[arg(long, value_enum, default_value_t = BouncesArg::Auto)]
    pub bounces: BouncesArg,

    /// Samples per pixel, 1 to 256, averaged for antialiasing; each costs as much as the first
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole(1..=MAX_SAMPLES))]
    pub samples: u32,

    /// Motion of the lamp in a sequence
    #[arg(long, value_enum, default_value_t = Lamp::Still, help_heading = "Frames")]
    pub lamp: Lamp,

    /// The ray tracing path
    #[command(flatten)]
    pub tracing: RayArgs,
}

/// The method that finds the visible surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum MethodArg {
    /// Trace everything, from the camera on.
    Standalone,
    /// Rasterise visible surfaces; trace shadows, mirrors and glass.
    Hybrid,
}

/// The data that the geometry pass writes for the rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum GBufferArg {
    /// Position, normals, albedo and triangle, as in the paper.
    Paper,
    /// The triangle alone.
    Visibility,
}

/// The rasteriser of visible triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum RasterArg {
    /// Compute shaders if the device supports them, else the hardware rasteriser; where frames are timed, prints the time
    /// of each over a few frames.
    Auto,
    /// Compute shaders with 64-bit atomics; the picture is exactly that of rays.
    Compute,
    /// The hardware rasteriser, after culling in compute shaders; rays decide at edges. Surfaces behind gaps narrower than
    /// a pixel are missing.
    Hardware,
}

/// The launch that traces the rays of mirrors and glass.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BouncesArg {
    /// The fastest for the device and the method.
    Auto,
    /// The thread of the pixel traces them at once.
    Inline,
    /// A second launch traces them, for only the pixels that have such rays.
    Queued,
    /// As `inline`, but pixels that have such rays are launched before the others; hybrid method only.
    First,
}

/// The motion of the lamp in a sequence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Lamp {
    /// The lamp stands still.
    Still,
    /// The lamp moves once round a small horizontal circle; frame 0 has the scene's position.
    Circle,
}
