//! The description of the sample's program: scene in, images and timings out.

use std::fmt::Write as _;

use lvk::{Capabilities, Context};

use super::args::{self, HybridArgs};
use super::{
    Bounces, Geometry, HybridConfig, HybridRenderer, HybridSequence, Method, Raster, RasterTuning, RayPath,
    pipelines,
};
use crate::app::device::device_text;
use crate::app::frames::Frames;
use crate::app::sample_info::prelude::*;
use crate::app::summary::path_text;
use crate::scene::Scene;

impl SampleInfo for HybridSequence {
    const NAME: &'static str = "hybrid";
    const ABOUT: &'static str =
        "Renders a scene with ray traced shadows, reflections and refractions, and writes pictures as PNG";
    const DETAILS: &'static str = "Without --scene the sample renders a generated courtyard.";
    const EXAMPLES: &'static str = "
        | the courtyard, on the most capable device and its fastest path
        --scene kitchen.obj --camera 3 --out k3.png | an OBJ through its third camera
        --samples 16 --out smooth.png | 16 samples per pixel
        --method standalone --rt query --frames 1 | everything ray traced in a compute shader, once
        --device 1 --validate | the second device, with validation
        --profile mali-g715 | emulates a phone: ray queries, split meshes
        --frames 100 | one picture, and the times of its passes over 100 frames
        --frames 0..240 --out dir/frame_####.png | 8 seconds through all five cameras, a seamless loop
        --frames 120..240 --out dir/frame_####.png | the second half, on another machine: the same pictures
        --frames 0..240 --out dir/frame_####.png --resume | only the missing pictures
    ";
    const ROUND: &'static str = "";
    const NOTES: &'static str = "\
Frame N of a sequence depends on N alone, so several processes may share a sequence. Ctrl-C stops after the current frame;
a picture gets its name when it is complete. A video of the pictures: ffmpeg -framerate 30 -i dir/frame_%04d.png film.mp4";
    type Args = HybridArgs;
    type Sample = Self;

    fn pipelines() -> Vec<SamplePipeline> {
        pipelines::pipelines()
    }

    fn listing(args: &HybridArgs) -> Option<String> {
        args.scene.list.listing()
    }

    fn open(args: &HybridArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Self>, RunError> {
        args.scene.check_out(&setup.args.out_or(Self::NAME))?;
        let scene = args.scene.load(&mut setup.progress)?;
        let (context, scene) = setup.device_for_scene(scene, &DeviceNeeds::tracing(args.tracing.rt))?;
        let path = RayPath::choose(RayPath::from_args(args.tracing.rt), context.capabilities())?;
        let wish = wished_method(args);
        let method = Method::choose(wish, context.capabilities());
        if wish.is_none() && method == Method::Standalone {
            setup.warn(&[stand_in(context.capabilities())]);
        }
        let config = config(args, setup.extent(), method, path);
        setup.progress.stage("uploading the scene and building acceleration structures", 0);
        let mut renderer = HybridRenderer::new(&context, &scene, &config)?;
        let mut summary = summary(&context, &scene, &config, &renderer);
        let first = args.scene.camera.index();
        if is_timed(setup.args.frames.as_ref(), context.capabilities().is_cpu) {
            renderer.measure_rasters(&scene.cameras[first])?;
        }
        if let Some(choice) = renderer.raster_choice() {
            let _ = write!(summary, "\ngeometry  {choice}");
        }
        let sample = Self::new(renderer, &scene, first, args.lamp == args::Lamp::Circle);
        Ok(ReadySample { sample, summary })
    }
}

/// True if frames are rendered again and again to time them. Then the rasterisers are timed too.
fn is_timed(frames: Option<&Frames>, is_cpu: bool) -> bool {
    match frames {
        Some(Frames::Still(count)) => *count > 1,
        Some(Frames::Sequence(_)) => false,
        None => !is_cpu,
    }
}

/// The method that is named, if only by something that it alone has.
fn wished_method(args: &HybridArgs) -> Option<Method> {
    let names_hybrid = args.gbuffer == args::GBufferArg::Paper
        || args.raster != args::RasterArg::Auto
        || args.bounces == args::BouncesArg::First;
    match args.method {
        Some(args::MethodArg::Standalone) => Some(Method::Standalone),
        Some(args::MethodArg::Hybrid) => Some(Method::Hybrid),
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

fn config(args: &HybridArgs, [width, height]: [u32; 2], method: Method, path: RayPath) -> HybridConfig {
    let raster = match args.raster {
        args::RasterArg::Auto => None,
        args::RasterArg::Compute => Some(Raster::Compute),
        args::RasterArg::Hardware => Some(Raster::Hardware),
    };
    let geometry = match args.gbuffer {
        args::GBufferArg::Paper => Geometry::Paper,
        args::GBufferArg::Visibility => Geometry::Visibility(raster),
    };
    let usual = RasterTuning::default();
    let (small_pixels, medium_pixels) = (args.small_triangle, args.medium_triangle);
    let tuning = RasterTuning { small_pixels, medium_pixels, ..usual };
    let bounces = match args.bounces {
        args::BouncesArg::Auto => None,
        args::BouncesArg::Inline => Some(Bounces::Inline),
        args::BouncesArg::Queued => Some(Bounces::Queued),
        args::BouncesArg::First => Some(Bounces::First),
    };
    let (max_depth, samples) = (args.depth, args.samples);
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
    let path = path_text(capabilities, config.path, "a compute shader");
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use lvk::DeviceProfile;

    use super::*;
    use crate::app::cli::{CommandLine, assert_refuses, command, parse_line};
    use crate::app::frames::Frames;
    use crate::app::ray_args::RayTracing;
    use crate::app::run_args::ValidationArg;

    #[test]
    fn rasterisers_are_timed_where_frames_are() {
        for is_cpu in [false, true] {
            assert_eq!(is_timed(None, is_cpu), !is_cpu);
            assert!(!is_timed(Some(&Frames::Still(1)), is_cpu));
            assert!(is_timed(Some(&Frames::Still(2)), is_cpu));
            assert!(!is_timed(Some(&Frames::Sequence(0..9)), is_cpu));
        }
    }

    fn parsed(line: &str) -> Result<CommandLine<HybridArgs>, clap::Error> {
        parse_line::<HybridSequence>(line)
    }

    #[test]
    fn defaults_are_those_of_the_help() {
        let args = parsed("").unwrap();
        let (args, run) = (&args.sample, &args.run);
        let scene = &args.scene;
        assert_eq!((run.width, run.height, scene.camera.number, args.depth), (1280, 720, 1, 4));
        assert_eq!((run.frames.clone(), run.round, run.resume), (None, 240, false));
        assert_eq!((args.method, args.tracing.rt, run.validate), (None, RayTracing::Auto, None));
        assert_eq!((args.gbuffer, args.raster), (args::GBufferArg::Visibility, args::RasterArg::Auto));
        assert_eq!((args.bounces, args.samples), (args::BouncesArg::Auto, 1));
        assert_eq!((scene.scene.clone(), args.lamp), (None, args::Lamp::Still));
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
        assert_eq!(parsed("--validate=gpu --camera 2").unwrap().run.validate, Some(ValidationArg::Gpu));
        assert_eq!(parsed("--validate --camera 2").unwrap().run.validate, Some(ValidationArg::Core));
    }

    #[test]
    fn profiles_are_chosen_by_name_and_listed() {
        assert_eq!(parsed("--profile mali-g715").unwrap().run.profile, Some(DeviceProfile::mali_g715()));
        let refusal = parsed("--profile pixel").unwrap_err();
        let (help, refused) = (command::<HybridSequence>().render_help().to_string(), refusal.to_string());
        assert_eq!(refusal.exit_code(), 2);
        for name in DeviceProfile::names() {
            assert!(help.contains(name) && refused.contains(name), "{name}: {help}{refused}");
        }
    }

    #[test]
    fn values_out_of_range_are_refused_with_exit_status_2() {
        assert_refuses::<HybridSequence>(&[
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
            "--validate=all",
            "--validate gpu",
            "extra",
        ]);
        assert_eq!(parsed("--width 16384 --height 1 --depth 0").unwrap().run.width, 16_384);
    }
}
