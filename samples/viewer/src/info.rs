//! The description of the sample's program.

use lvk_samples::app::loading::Loading;
use lvk_samples::app::png;
use lvk_samples::app::progress::Progress;
use lvk_samples::app::ray_args::RayTracing;
use lvk_samples::app::sample_info::prelude::*;

use crate::args::ViewerArgs;
use crate::config::Content;
use crate::model::cameras;
use crate::names::{animation_lines, numbered};
use crate::open::{Request, model};
use crate::pipelines;
use crate::viewer::Viewer;

/// Descriptor slots beside those of the model's images.
const OTHER_TEXTURES: u32 = 64;
/// Descriptor slots of a window, which is there before the model, and where other models can be dropped.
const WINDOW_TEXTURES: u32 = 1 << 14;

impl SampleInfo for Viewer {
    const NAME: &'static str = pipelines::SAMPLE;
    const ABOUT: &'static str =
        "Shows a glTF or OBJ model by hybrid ray tracing or by a path tracer, and writes pictures as PNG";
    const DETAILS: &'static str = "Without FILE the sample shows balls of many materials around a knot. The hybrid \
        method finds surfaces by rays or by a rasteriser, traces a few rays from each, and filters over time and space. The path \
        tracer is the reference: light of the sun, the sky and the model's lamps reaches surfaces by up to `--bounces` reflections \
        and refractions, and more samples have less noise and the same mean.";
    const EXAMPLES: &'static str = "
        | the built-in model, on the most capable device and its fastest path
        model.glb --method pathtrace --samples 1024 | a glTF file by the path tracer
        model.gltf --camera 2 --exposure -1 | through its second camera, half as bright
        kitchen.obj --sky black | an OBJ file, lit by its lamp alone
        model.glb --sky garden.hdr --sky-rotation 90 | under the sky of a Radiance HDR file, turned to the left by a quarter
        model.glb --window | in a window, where the picture gets better while nothing moves
        model.glb --animation walk --time 0.5 | in a pose of an animation, which --frames 0..60 and a window play from there
        --rt query --validate | ray queries in a compute shader, with validation
    ";
    const ROUND: &'static str = "one round about what the camera looks at, or the animation";
    type Args = ViewerArgs;
    type Sample = Loading<Self>;

    fn pipelines() -> Vec<SamplePipeline> {
        pipelines::pipelines()
    }

    fn listing(args: &ViewerArgs) -> Option<String> {
        // A file that cannot be read is reported by `open`.
        let model = args.list_cameras.then(|| model(args, &mut Progress::hidden()).ok()).flatten()?;
        let scene = model.default_scene.unwrap_or(0);
        let cameras = numbered(&cameras(&model, scene, &model.pose(None, 0.0)));
        let animations = animation_lines(&model).into_iter().map(|line| format!("animation {line}"));
        Some(cameras.into_iter().chain(animations).collect::<Vec<_>>().join("\n"))
    }

    fn open(args: &ViewerArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Loading<Self>>, RunError> {
        if let Some(file) = &args.file {
            png::check_not_input(&setup.args.out_or(Self::NAME), "FILE", file)?;
        }
        let (extent, is_for_window) = (setup.extent(), setup.is_for_window());
        let request = Request { args: args.clone(), extent, is_for_window };
        if is_for_window { in_background(request, setup) } else { at_once(&request, setup) }
    }
}

/// A window is there before the model: a thread loads that while frames show how far it is.
fn in_background(
    request: Request,
    setup: &mut SampleSetup<'_>,
) -> Result<ReadySample<Loading<Viewer>>, RunError> {
    let context = setup.device(&needs(&request.args, WINDOW_TEXTURES))?;
    setup.progress.pause();
    let ctx = context.clone();
    let sample = Loading::start(&context, move |progress| {
        let model = request.model(progress)?;
        request.viewer(&ctx, model, progress)
    })?;
    Ok(ReadySample { sample, summary: String::new() })
}

/// The device is opened when it is known how many textures it is to have room for.
fn at_once(request: &Request, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Loading<Viewer>>, RunError> {
    let model = request.model(&mut setup.progress)?;
    let textures = model.model.images.len() as u32 + OTHER_TEXTURES;
    let context = setup.device(&needs(&request.args, textures))?;
    let ReadySample { sample, summary } = request.viewer(&context, model, &mut setup.progress)?;
    Ok(ReadySample { sample: Loading::ready(sample), summary })
}

/// Returns what the device must have: its own pipelines, if any, since a path is shaded at each of its surfaces, or the queries that
/// count steps.
fn needs(args: &ViewerArgs, textures: u32) -> DeviceNeeds {
    let wish = match args.tracing.rt {
        RayTracing::Auto if args.view == Content::Steps => RayTracing::Software,
        wish => wish,
    };
    DeviceNeeds { textures, prefers_device_pipelines: true, ..DeviceNeeds::tracing(wish) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{CullingMode, IndirectLight, LightRate, PrimaryVisibility, ViewerConfig};
    use crate::light::SunSetting;
    use lvk_samples::app::cli::{command, parse};

    fn parsed(line: &str) -> Option<ViewerArgs> {
        let words = ["viewer"].into_iter().chain(line.split_whitespace());
        parse::<Viewer>(words).ok().map(|line| line.sample)
    }

    #[test]
    fn the_command_line_is_valid_and_its_defaults_are_those_of_the_configuration() {
        command::<Viewer>().debug_assert();
        let args = parsed("").unwrap();
        assert_eq!(
            (args.samples, args.bounces),
            (ViewerConfig::DEFAULT_SAMPLES, ViewerConfig::DEFAULT_BOUNCES)
        );
        let sun = SunSetting::default();
        assert_eq!(args.light.sun_elevation, sun.elevation_degrees);
        assert_eq!(args.light.sun_azimuth, sun.azimuth_degrees);
        assert_eq!(args.light.sun_radius, sun.radius_degrees);
        assert_eq!(parsed("model.glb --exposure -1.5").unwrap().exposure, -1.5);
        assert_eq!(args.culling, CullingMode::default());
        assert_eq!(args.primary, PrimaryVisibility::Rays);
        assert_eq!(args.indirect, IndirectLight::default());
        assert_eq!(args.cache_entries, ViewerConfig::DEFAULT_CACHE_ENTRIES);
        assert_eq!(parsed("--indirect cache").unwrap().indirect, IndirectLight::Cache);
        assert_eq!(parsed("--indirect ambient-occlusion").unwrap().indirect, IndirectLight::AmbientOcclusion);
        assert_eq!(args.light_rate, LightRate::Full);
        assert_eq!(parsed("--light-rate quarter").unwrap().light_rate, LightRate::Quarter);
        assert_eq!(parsed("--primary raster").unwrap().primary, PrimaryVisibility::Raster);
        assert_eq!(parsed("--culling none").unwrap().culling, CullingMode::None);
        assert!(!args.real_time && parsed("--real-time --frames 0..9").unwrap().real_time);
    }

    #[test]
    fn steps_are_counted_in_software_unless_a_path_is_named() {
        let rays = |line| needs(&parsed(line).unwrap(), 1).rays;
        assert_eq!(rays(""), Some(RayTracing::Auto));
        assert_eq!(rays("--view steps"), Some(RayTracing::Software));
        assert_eq!(rays("--view steps --rt query"), Some(RayTracing::Query));
    }

    #[test]
    fn a_file_behind_the_flag_of_validation_is_the_model() {
        let args = parsed("--validate model.glb").unwrap();
        assert_eq!(args.file.as_deref(), Some(std::path::Path::new("model.glb")));
    }

    #[test]
    fn values_out_of_range_are_refused() {
        for line in [
            "--samples 0",
            "--samples 65537",
            "--bounces 0",
            "--exposure nan",
            "--exposure 21",
            "--sun-elevation 0",
            "--sun-radius 0",
            "--tone film",
            "--culling everything",
            "--primary guess",
            "--indirect guess",
            "--light-rate half",
            "--cache-entries 0",
            "--real-time --frames 0..9 --resume",
            "a.glb b.glb",
        ] {
            assert_eq!(parsed(line), None, "{line}");
        }
    }
}
