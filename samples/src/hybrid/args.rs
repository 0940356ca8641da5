//! The command line of the `hybrid` sample.

use clap::{Parser, ValueEnum};

use crate::app::ray_args::RayArgs;
use crate::app::run_args::RunArgs;
use crate::app::scene_args::SceneArgs;

/// Largest number of bounces.
pub const MAX_DEPTH: u32 = 16;
/// Largest number of samples.
pub const MAX_SAMPLES: u32 = 256;

/// Renders a scene with ray traced shadows, reflections and refractions, and writes pictures as PNG.
///
/// Without --scene it shows a courtyard made by code, so that `cargo run --release` alone gives a picture.
#[derive(Debug, Clone, PartialEq, Parser)]
#[command(name = "hybrid", version, after_help = EXAMPLES)]
pub struct HybridArgs {
    /// Which scene, and from where it is seen
    #[command(flatten)]
    pub scene: SceneArgs,

    /// How to find what a pixel sees [default: hybrid, or standalone on a device that cannot]
    #[arg(long, value_enum, help_heading = "Rendering")]
    pub method: Option<Method>,

    /// What the hybrid method's geometry pass leaves for the rays
    #[arg(long, value_enum, default_value_t = GBuffer::Visibility, help_heading = "Rendering")]
    pub gbuffer: GBuffer,

    /// How to rasterise visible triangles
    #[arg(long, value_enum, default_value_t = Raster::Auto, help_heading = "Rendering")]
    pub raster: Raster,

    /// Most pixels of a triangle that one thread of the compute rasteriser takes on, for tuning
    #[arg(long, value_name = "PIXELS", hide = true)]
    pub small_triangle: Option<u32>,

    /// Most pixels of a triangle that some threads take on together, for tuning
    #[arg(long, value_name = "PIXELS", hide = true)]
    pub medium_triangle: Option<u32>,

    /// How often a ray may be reflected or refracted before it gives up, 0 to 16; 0 gives shadows only
    #[arg(
        long,
        value_name = "N",
        default_value_t = 4,
        value_parser = clap::value_parser!(u32).range(0..=i64::from(MAX_DEPTH)),
        help_heading = "Rendering"
    )]
    pub depth: u32,

    /// When to follow the rays of mirrors and glass; the picture is the same
    #[arg(long, value_enum, default_value_t = Bounces::Auto, help_heading = "Rendering")]
    pub bounces: Bounces,

    /// Views of each pixel, 1 to 256, whose average smooths edges; each costs as much as the first
    #[arg(
        long,
        value_name = "N",
        default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SAMPLES)),
        help_heading = "Rendering"
    )]
    pub samples: u32,

    /// What the lamp does in a sequence
    #[arg(long, value_enum, default_value_t = Lamp::Still, help_heading = "Frames")]
    pub lamp: Lamp,

    /// By what rays are traced
    #[command(flatten)]
    pub tracing: RayArgs,

    /// Frames, pictures and device
    #[command(flatten)]
    pub run: RunArgs,
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
    /// By compute where the device can, as its picture is exactly that of rays; says how long each took in a few frames.
    Auto,
    /// By compute shaders with 64-bit atomics.
    Compute,
    /// By the device's rasteriser, after culling in compute shaders; where it is in doubt rays decide, but it misses what
    /// shows through gaps narrower than a pixel.
    Hardware,
}

/// When the rays of mirrors and glass are followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Bounces {
    /// What suits the device and the method.
    Auto,
    /// At once, by the thread of the pixel.
    Inline,
    /// In a launch of their own, of just the pixels that have some.
    Queued,
    /// At once, but pixels that have some are launched before the others; for the hybrid method.
    First,
}

/// What the lamp does in a sequence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Lamp {
    /// It stays where it is.
    Still,
    /// It goes round once in a small level circle, through its own place in frame 0.
    Circle,
}

const EXAMPLES: &str = "\
Examples:
  hybrid                                                  the courtyard, by the best path of the best device
  hybrid --scene kitchen.obj --camera 3 --out k3.png      an OBJ through its third camera
  hybrid --samples 16 --out smooth.png                    with smooth edges
  hybrid --method standalone --rt query --frames 1        everything ray traced in a compute shader, once
  hybrid --device 1 --validate                            on the second device, with validation
  hybrid --profile mali-g715                              as on a phone: ray queries, split meshes
  hybrid --frames 100                                     one picture, and how long its passes take over 100 frames
  hybrid --frames 0..240 --out dir/frame_####.png         8 seconds through all five cameras, which repeat without a seam
  hybrid --frames 120..240 --out dir/frame_####.png       their second half, on another machine: the same pictures
  hybrid --frames 0..240 --out dir/frame_####.png --resume    what is missing of them

Frame N of a sequence depends on N alone, so any number of processes may share one. Ctrl-C ends after the frame under way;
pictures get their names when they are complete. A accumulation of them: ffmpeg -framerate 30 -i dir/frame_%04d.png accumulation.mp4

Exit status: 0 when the pictures were written, 1 for trouble with the device, 2 for wrong arguments or input, 130 after
Ctrl-C.";

#[cfg(test)]
mod tests {
    use clap::CommandFactory;
    use lvk::DeviceProfile;
    use std::path::Path;

    use super::*;
    use crate::app::frames::Frames;
    use crate::app::ray_args::RayTracing;
    use crate::app::run_args::ValidationArg;

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
        let (run, scene) = (&args.run, &args.scene);
        assert_eq!((run.width, run.height, scene.camera.number, args.depth), (1280, 720, 1, 4));
        assert_eq!((run.frames.clone(), run.round, run.resume), (None, 240, false));
        assert_eq!((args.method, args.tracing.rt, run.validate), (None, RayTracing::Auto, None));
        assert_eq!((args.gbuffer, args.raster), (GBuffer::Visibility, Raster::Auto));
        assert_eq!((args.bounces, args.samples), (Bounces::Auto, 1));
        assert_eq!((scene.scene.clone(), args.lamp), (None, Lamp::Still));
        assert_eq!(run.out_or("hybrid"), Path::new("hybrid.png"));
    }

    #[test]
    fn a_range_of_frames_has_numbered_pictures() {
        let args = parsed("--frames 3..9").unwrap();
        assert_eq!(args.run.frames, Some(Frames::Sequence(3..9)));
        assert_eq!(args.run.out_or("hybrid"), Path::new("hybrid_####.png"));
    }

    #[test]
    fn validation_has_a_plain_and_a_deep_kind() {
        assert_eq!(parsed("--validate").unwrap().run.validate, Some(ValidationArg::Core));
        assert_eq!(parsed("--validate gpu --camera 2").unwrap().run.validate, Some(ValidationArg::Gpu));
        assert_eq!(parsed("--validate --camera 2").unwrap().run.validate, Some(ValidationArg::Core));
    }

    #[test]
    fn profiles_are_chosen_by_name_and_listed() {
        assert_eq!(parsed("--profile mali-g715").unwrap().run.profile, Some(DeviceProfile::mali_g715()));
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
            "--samples 0",
            "--samples 257",
            "--bounces never",
            "--frames 0",
            "--frames 4..4",
            "--frames 0..",
            "--resume",
            "--round 0",
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
        assert_eq!(parsed("--width 16384 --height 1 --depth 0").unwrap().run.width, 16_384);
    }
}
