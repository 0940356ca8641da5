//! The description of the sample's program.

use lvk_gltf::Model;
use lvk_samples::app::png;
use lvk_samples::app::progress::Progress;
use lvk_samples::app::sample_info::prelude::*;
use lvk_samples::hybrid::RayPath;

use crate::args::{LightArgs, SkyArg, ViewerArgs};
use crate::config::ViewerConfig;
use crate::light::{Environment, SunSetting};
use crate::model::{ModelCamera, ModelError, cameras, load, showcase};
use crate::pipelines;
use crate::viewer::{Viewer, ViewerScene};

/// Descriptor slots beside those of the model's images.
const OTHER_TEXTURES: u32 = 64;

/// Errors of the sample's arguments.
#[derive(Debug, thiserror::Error)]
enum ArgumentError {
    /// The model has no such animation.
    #[error("--animation {wish}: the model has {known}")]
    NoAnimation {
        /// As given.
        wish: String,
        /// Numbers and names.
        known: String,
    },
    /// The model has no such camera.
    #[error("--camera {wish}: the model has the cameras {known}")]
    NoCamera {
        /// As given.
        wish: String,
        /// Numbers and names.
        known: String,
    },
}

impl SampleInfo for Viewer {
    const NAME: &'static str = pipelines::SAMPLE;
    const ABOUT: &'static str =
        "Shows a glTF or OBJ model by hybrid ray tracing or by a path tracer, and writes pictures as PNG";
    const DETAILS: &'static str = "Without FILE the sample shows balls of many materials around a knot. The hybrid \
        method rasterises surfaces, traces a few rays from each, and filters over time and space. The path tracer is the reference: \
        light of the sun, the sky and the model's lamps reaches surfaces by any number of reflections and refractions, and more \
        samples have less noise and the same mean.";
    const EXAMPLES: &'static str = "
        | the built-in model, on the most capable device and its fastest path
        model.glb --method pathtrace --samples 1024 | a glTF file by the path tracer
        model.gltf --camera 2 --exposure -1 | through its second camera, half as bright
        kitchen.obj --sky black | an OBJ file, lit by its lamp alone
        model.glb --window | in a window, where the picture gets better while nothing moves
        model.glb --animation walk --time 0.5 | in a pose of an animation, which --frames 0..60 and a window play from there
        --rt query --validate | ray queries in a compute shader, with validation
    ";
    const ROUND: &'static str = "one round about what the camera looks at, or the animation";
    type Args = ViewerArgs;
    type Sample = Self;

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

    fn open(args: &ViewerArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Self>, RunError> {
        if let Some(file) = &args.file {
            png::check_not_input(&setup.args.out_or(Self::NAME), "FILE", file)?;
        }
        let model = model(args, &mut setup.progress).map_err(RunError::input)?;
        let animation = args.animation.as_deref().map(|wish| animation_place(&model, wish));
        let animation = animation.transpose().map_err(RunError::input)?;
        let warnings: Vec<String> = model.warnings.iter().map(ToString::to_string).collect();
        setup.warn(&warnings);
        let textures = model.images.len() as u32 + OTHER_TEXTURES;
        let context = setup.device(&DeviceNeeds { textures, ..DeviceNeeds::tracing(args.tracing.rt) })?;
        let path = RayPath::choose(RayPath::from_args(args.tracing.rt), context.capabilities())?;
        setup.progress.stage("uploading the model and building acceleration structures", 0);
        let [width, height] = setup.extent();
        let config = ViewerConfig {
            method: args.method,
            content: args.view,
            samples: args.samples,
            bounces: args.bounces,
            exposure_stops: args.exposure,
            tone_mapping: args.tone,
            is_progressive: setup.is_for_window(),
            ..ViewerConfig::new(path, width, height)
        };
        let scene = scene(args, model);
        let mut sample = Self::new(&context, &scene, &config)?;
        setup.warn(sample.warnings());
        sample.play(animation, args.time);
        if let Some(wish) = &args.camera {
            let place = camera_place(sample.cameras(), wish).map_err(RunError::input)?;
            sample.choose_camera(place);
        }
        let (triangles, instances) = sample.counts();
        let text = format!(
            "{}: {triangles} triangles, {instances} instances; {} samples a pixel, paths of {} surfaces at most",
            scene.name, config.samples, config.bounces
        );
        Ok(ReadySample::ray_traced(sample, path, "a compute shader", &text))
    }
}

fn model(args: &ViewerArgs, progress: &mut Progress) -> Result<Model, ModelError> {
    args.file.as_deref().map_or_else(|| Ok(showcase()), |file| load(file, progress))
}

/// The model with the light that the arguments ask for. A model with directional lights of its own needs no sun.
fn scene(args: &ViewerArgs, model: Model) -> ViewerScene {
    let LightArgs { sky, sun_elevation, sun_azimuth, sun_radius } = args.light;
    let has_sun = model.lights.iter().any(|light| light.kind == lvk_gltf::LightKind::Directional);
    let mut environment = match sky {
        SkyArg::Day => Environment::day(&SunSetting {
            elevation_degrees: sun_elevation,
            azimuth_degrees: sun_azimuth,
            radius_degrees: sun_radius,
        }),
        SkyArg::White => Environment::uniform([1.0; 3]),
        SkyArg::Black => Environment::uniform([0.0; 3]),
    };
    environment.sun = environment.sun.filter(|_| !has_sun);
    let name = args.file.as_deref().map_or_else(|| "showcase".to_owned(), lvk::readable_name);
    ViewerScene { name, model, environment, disc_radius: sun_radius.to_radians() }
}

/// The animation that the arguments name.
fn animation_place(model: &Model, wish: &str) -> Result<usize, ArgumentError> {
    let number = wish.parse::<usize>().ok().filter(|number| (1..=model.animations.len()).contains(number));
    let named = || model.animations.iter().position(|animation| animation.name.as_deref() == Some(wish));
    number.map(|number| number - 1).or_else(named).ok_or_else(|| {
        let known = animation_lines(model);
        let known = if known.is_empty() { "no animation".to_owned() } else { known.join(", ") };
        ArgumentError::NoAnimation { wish: lvk::readable_name(wish), known }
    })
}

/// The animations, a line each.
fn animation_lines(model: &Model) -> Vec<String> {
    let name =
        |animation: &lvk_gltf::Animation| animation.name.clone().unwrap_or_else(|| "animation".to_owned());
    (1..)
        .zip(&model.animations)
        .map(|(number, animation)| format!("{number}  {}", lvk::readable_name(name(animation))))
        .collect()
}

/// The cameras, a line each.
fn numbered(cameras: &[ModelCamera]) -> Vec<String> {
    let line =
        |(number, camera): (usize, &ModelCamera)| format!("{number}  {}", lvk::readable_name(&camera.name));
    (1..).zip(cameras).map(line).collect()
}

fn camera_place(cameras: &[ModelCamera], wish: &str) -> Result<usize, ArgumentError> {
    let number = wish.parse::<usize>().ok().filter(|number| (1..=cameras.len()).contains(number));
    let place = number.map(|number| number - 1);
    let place = place.or_else(|| cameras.iter().position(|camera| camera.name == wish));
    place.ok_or_else(|| ArgumentError::NoCamera {
        wish: lvk::readable_name(wish),
        known: numbered(cameras).join(", "),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
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
            "a.glb b.glb",
        ] {
            assert_eq!(parsed(line), None, "{line}");
        }
    }

    #[test]
    fn cameras_are_chosen_by_number_or_name() {
        let model = showcase();
        let all = cameras(&model, 0, &model.pose(None, 0.0));
        assert_eq!(camera_place(&all, "1").unwrap(), 0);
        assert_eq!(camera_place(&all, "overview").unwrap(), all.len() - 1);
        let error = camera_place(&all, "9").unwrap_err().to_string();
        assert_eq!(error, "--camera 9: the model has the cameras 1  showcase, 2  overview");
    }
}
