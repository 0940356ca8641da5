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

    /// Method that finds the visible surfaces [default: hybrid, or standalone on a device that cannot]
    #[arg(long, value_enum)]
    pub method: Option<MethodArg>,

    /// Data that the hybrid method's geometry pass leaves for the rays
    #[arg(long, value_enum, default_value_t = GBufferArg::Visibility)]
    pub gbuffer: GBufferArg,

    /// Rasteriser of visible triangles
    #[arg(long, value_enum, default_value_t = RasterArg::Auto)]
    pub raster: RasterArg,

    /// Most pixels of a triangle that one thread of the compute rasteriser takes on, for tuning
    #[arg(long, value_name = "PIXELS", hide = true)]
    pub small_triangle: Option<u32>,

    /// Most pixels of a triangle that some threads take on together, for tuning
    #[arg(long, value_name = "PIXELS", hide = true)]
    pub medium_triangle: Option<u32>,

    /// Maximum number of reflections and refractions of a ray, 0 to 16; 0 gives shadows only
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = whole(0..=MAX_DEPTH))]
    pub depth: u32,

    /// Time at which the rays of mirrors and glass are traced; the image is the same
    #[arg(long, value_enum, default_value_t = BouncesArg::Auto)]
    pub bounces: BouncesArg,

    /// Views of each pixel, 1 to 256, whose average smooths edges; each costs as much as the first
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
    /// Everything by rays, from the camera on.
    Standalone,
    /// Rasterise first; rays only for shadows, mirrors and glass.
    Hybrid,
}

/// The data that the geometry pass leaves for the rays.
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
    /// By compute where the device can, as its picture is exactly that of rays; says how long each took in a few frames.
    Auto,
    /// By compute shaders with 64-bit atomics.
    Compute,
    /// By the device's rasteriser, after culling in compute shaders; where it is in doubt rays decide, but it misses what
    /// shows through gaps narrower than a pixel.
    Hardware,
}

/// The time at which rays of mirrors and glass are traced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BouncesArg {
    /// The best for the device and the method.
    Auto,
    /// At once, by the thread of the pixel.
    Inline,
    /// In a launch of their own, of just the pixels that have some.
    Queued,
    /// At once, but pixels that have some are launched before the others; for the hybrid method.
    First,
}

/// The motion of the lamp in a sequence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Lamp {
    /// It stays where it is.
    Still,
    /// It goes round once in a small level circle, through its own place in frame 0.
    Circle,
}
