//! The command line of the `hybrid` sample.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser as _};
use clap::{Parser, ValueEnum};
use lvk::DeviceProfile;

/// Largest width and height of a picture, in pixels.
pub const MAX_SIZE: u32 = 16_384;

/// Largest number of bounces.
pub const MAX_DEPTH: u32 = 16;

/// Renders a scene with ray traced shadows, reflections and refractions, and writes the last frame as a PNG.
///
/// Without --scene it shows a courtyard made by code, so that `cargo run --release` alone gives a picture.
#[derive(Debug, Clone, PartialEq, Parser)]
#[command(name = "hybrid", version, after_help = EXAMPLES)]
pub struct HybridArgs {
    /// Wavefront OBJ to render, with its MTL and textures beside it [default: the built-in courtyard]
    #[arg(long, value_name = "FILE", help_heading = "Scene")]
    pub scene: Option<PathBuf>,

    /// Factor from the file's units to scene units [default: 1, or the known scale of a benchmark scene]
    #[arg(long, value_name = "F", value_parser = positive, requires = "scene", help_heading = "Scene")]
    pub scale: Option<f32>,

    /// Light and up to five cameras: lines `scene NAME x y z`, then `at EYE TARGET FOV` or `dir EYE DIRECTION FOV`
    #[arg(long, value_name = "FILE", requires = "scene", help_heading = "Scene")]
    pub cameras: Option<PathBuf>,

    /// Which of the scene's five cameras to look through
    #[arg(
        long,
        value_name = "1-5",
        default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..=5),
        help_heading = "Scene"
    )]
    pub camera: u32,

    /// How to find what a pixel sees
    #[arg(long, value_enum, default_value_t = Method::Hybrid, help_heading = "Rendering")]
    pub method: Method,

    /// What the hybrid method's geometry pass leaves for the rays
    #[arg(long, value_enum, default_value_t = GBuffer::Visibility, help_heading = "Rendering")]
    pub gbuffer: GBuffer,

    /// How to rasterise visible triangles
    #[arg(long, value_enum, default_value_t = Raster::Auto, help_heading = "Rendering")]
    pub raster: Raster,

    /// Most pixels of a triangle that one thread of the compute rasteriser takes on, for tuning
    #[arg(long, value_name = "PIXELS", hide = true)]
    pub small_triangle: Option<u32>,

    /// How to trace rays
    #[arg(long, value_enum, default_value_t = RayTracing::Auto, help_heading = "Rendering")]
    pub rt: RayTracing,

    /// How often a ray may be reflected or refracted before it gives up, 0 to 16; 0 gives shadows only
    #[arg(
        long,
        value_name = "N",
        default_value_t = 4,
        value_parser = clap::value_parser!(u32).range(0..=i64::from(MAX_DEPTH)),
        help_heading = "Rendering"
    )]
    pub depth: u32,

    /// Frames to render and time [default: 60, or 1 on a driver that runs on the CPU]
    #[arg(
        long,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=1_000_000),
        help_heading = "Rendering"
    )]
    pub frames: Option<u32>,

    /// Width of the picture in pixels, 1 to 16384
    #[arg(
        long,
        value_name = "PIXELS",
        default_value_t = 1280,
        value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SIZE)),
        help_heading = "Output"
    )]
    pub width: u32,

    /// Height of the picture in pixels, 1 to 16384
    #[arg(
        long,
        value_name = "PIXELS",
        default_value_t = 720,
        value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SIZE)),
        help_heading = "Output"
    )]
    pub height: u32,

    /// PNG to write; an existing file is replaced
    #[arg(long, value_name = "FILE", default_value = "hybrid.png", help_heading = "Output")]
    pub out: PathBuf,

    /// Device to use, by its number in --list-devices or part of its name
    /// [default: the most capable one that can trace rays]
    #[arg(long, value_name = "NUMBER|NAME", help_heading = "Device")]
    pub device: Option<String>,

    /// Rehearse another device on this one: without what it lacks, and within its limits
    #[arg(
        long,
        value_name = "NAME",
        value_parser = PossibleValuesParser::new(DeviceProfile::names()).try_map(|name| DeviceProfile::named(&name)),
        help_heading = "Device"
    )]
    pub profile: Option<DeviceProfile>,

    /// Print the devices and what they can do, and exit
    #[arg(long, help_heading = "Device")]
    pub list_devices: bool,

    /// Run with Vulkan validation; a message is an error
    #[arg(
        long,
        value_enum,
        value_name = "KIND",
        num_args = 0..=1,
        default_missing_value = "core",
        help_heading = "Device"
    )]
    pub validate: Option<Validation>,
}

/// How to find what a pixel sees.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Everything by rays, from the camera on.
    Standalone,
    /// Rasterise first; rays only for shadows, mirrors and glass.
    Hybrid,
}

/// What the geometry pass leaves for the rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum GBuffer {
    /// Position, normals, albedo and triangle, as in the paper.
    Paper,
    /// The triangle alone.
    Visibility,
}

/// How to rasterise visible triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Raster {
    /// By compute, unless hardware is much faster in a few frames at the start.
    Auto,
    /// By compute shaders with 64-bit atomics.
    Compute,
    /// By the device's rasteriser, after culling in compute shaders.
    Hardware,
}

/// How to trace rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum RayTracing {
    /// A ray tracing pipeline where the device has one, else ray queries.
    Auto,
    /// A ray tracing pipeline with shader binding table.
    Pipeline,
    /// Ray queries in a compute shader.
    Query,
}

/// What Vulkan validation checks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Validation {
    /// Correct use and synchronisation.
    Core,
    /// The same, and what shaders do on the device; slow.
    Gpu,
}

const EXAMPLES: &str = "\
Examples:
  hybrid                                                  the courtyard, by the best path of the best device
  hybrid --scene kitchen.obj --camera 3 --out k3.png      an OBJ through its third camera
  hybrid --method standalone --rt query --frames 1        everything ray traced in a compute shader, once
  hybrid --device 1 --validate                            on the second device, with validation
  hybrid --profile mali-g715                              as on a phone: ray queries, split meshes

Exit status: 0 when the picture was written, 1 for trouble with the device, 2 for wrong arguments or input.";

fn positive(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("a positive number is needed".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    fn parsed(line: &str) -> Result<HybridArgs, clap::Error> {
        HybridArgs::try_parse_from(std::iter::once("hybrid").chain(line.split_whitespace()))
    }

    #[test]
    fn the_definition_is_sound() {
        HybridArgs::command().debug_assert();
    }

    #[test]
    fn defaults_are_those_of_the_help() {
        let args = parsed("").unwrap();
        assert_eq!((args.width, args.height, args.camera, args.depth, args.frames), (1280, 720, 1, 4, None));
        assert_eq!((args.method, args.rt, args.validate), (Method::Hybrid, RayTracing::Auto, None));
        assert_eq!((args.gbuffer, args.raster), (GBuffer::Visibility, Raster::Auto));
        assert_eq!((args.scene, args.out), (None, PathBuf::from("hybrid.png")));
    }

    #[test]
    fn validation_has_a_plain_and_a_deep_kind() {
        assert_eq!(parsed("--validate").unwrap().validate, Some(Validation::Core));
        assert_eq!(parsed("--validate gpu --camera 2").unwrap().validate, Some(Validation::Gpu));
        assert_eq!(parsed("--validate --camera 2").unwrap().validate, Some(Validation::Core));
    }

    #[test]
    fn profiles_are_chosen_by_name_and_listed() {
        assert_eq!(parsed("--profile mali-g715").unwrap().profile, Some(DeviceProfile::mali_g715()));
        let refusal = parsed("--profile pixel").unwrap_err();
        let (help, refused) = (HybridArgs::command().render_help().to_string(), refusal.to_string());
        assert_eq!(refusal.exit_code(), 2);
        for name in DeviceProfile::names() {
            assert!(help.contains(name) && refused.contains(name), "{name}: {help}{refused}");
        }
    }

    #[test]
    fn values_out_of_range_are_refused_with_exit_status_2() {
        for line in [
            "--width 0",
            "--height 16385",
            "--camera 0",
            "--camera 6",
            "--depth 17",
            "--frames 0",
            "--scene a.obj --scale 0",
            "--scene a.obj --scale nan",
            "--scene a.obj --scale -1",
            "--scale 2",
            "--cameras c.txt",
            "--rt mesh",
            "--method both",
            "--validate all",
            "extra",
        ] {
            assert_eq!(parsed(line).unwrap_err().exit_code(), 2, "{line}");
        }
        assert_eq!(parsed("--width 16384 --height 1 --depth 0").unwrap().width, 16_384);
    }
}
