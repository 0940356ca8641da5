//! Scenes that take the place of another: files that are dropped on the viewer, and scenes of programs.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::Path;
use std::time::{Duration, Instant};

use lvk_samples::app::headless;
use lvk_samples::app::sample::Sample as _;
use lvk_samples::hybrid::RayPath;
use lvk_samples::scene::Camera;
use lvk_tests::rtx_sample::software_device;
use lvk_viewer::light::{Environment, SunSetting};
use lvk_viewer::{CullingMode, IndirectLight, Method, PrimaryVisibility, Viewer, ViewerConfig};

use crate::moving_model::moving_model;
use crate::paths::assert_alike;
use crate::scenes::{View, config, configured_viewer, scene, viewer};
use crate::still_life::still_life;

const PATIENCE: Duration = Duration::from_secs(120);

/// Renders frames until `is_there` says so.
fn wait(viewer: &mut Viewer, is_there: impl Fn(&Viewer) -> bool) {
    let deadline = Instant::now() + PATIENCE;
    while !is_there(viewer) {
        assert!(Instant::now() < deadline, "{} is still shown, {:?}", viewer.name(), viewer.drop_error());
        headless::picture(viewer).unwrap();
    }
}

/// Nothing of the scene before is in the picture: no history, no cached light, no list of what was seen.
#[test]
fn a_scene_in_place_of_another_looks_as_in_a_viewer_of_its_own() {
    let Some(ctx) = software_device() else { return };
    let camera = Camera::looking_at([1.5, 1.7, 4.5], [-0.2, 0.5, 0.0], 40.0);
    let view = View { camera, size: [60, 40], samples: 8 };
    let environment = Environment::day(&SunSetting::default());
    let usual = config((Method::Hybrid, RayPath::Query), &view);
    let rasterised = ViewerConfig {
        primary: PrimaryVisibility::Raster,
        culling: CullingMode::Occlusion,
        indirect: IndirectLight::Cache,
        ..usual
    };
    let occluded = ViewerConfig { indirect: IndirectLight::AmbientOcclusion, ..usual };
    for config in [rasterised, occluded] {
        let mut own = configured_viewer(&ctx, &config, &still_life(), &environment, &view);
        headless::picture(&mut own).unwrap();
        let expected = own.radiance().unwrap();
        // The same pipelines show another scene by other light, and then this one.
        own.show(scene(&moving_model(), &Environment::uniform([3.0, 0.1, 0.1]))).unwrap();
        own.set_view(&camera);
        assert!(own.radiance().unwrap().iter().all(|pixel| *pixel == [0.0; 3]), "no frame of it is there");
        headless::picture(&mut own).unwrap();
        own.show(scene(&still_life(), &environment)).unwrap();
        own.set_view(&camera);
        headless::picture(&mut own).unwrap();
        assert_alike(&format!("{:?}", config.indirect), &expected, &own.radiance().unwrap());
    }
}

#[test]
fn a_dropped_file_takes_the_place_of_the_model_and_its_error_does_not() {
    let Some(ctx) = software_device() else { return };
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let camera = Camera::looking_at([1.5, 1.7, 4.5], [-0.2, 0.5, 0.0], 40.0);
    let view = View { camera, size: [48, 32], samples: 1 };
    let environment = Environment::uniform([1.0; 3]);
    let mut viewer = viewer(&ctx, (Method::Hybrid, RayPath::Query), &still_life(), &environment, &view);
    viewer.configure(&ViewerConfig { is_progressive: true, ..*viewer.config() }).unwrap();
    let before = viewer.counts();

    viewer.drop_file(&write("bad.obj", "v 0 0 0\nf 1 2 3\n"));
    wait(&mut viewer, |viewer| viewer.drop_error().is_some());
    assert!(viewer.drop_error().unwrap().contains("bad.obj"), "{:?}", viewer.drop_error());
    assert_eq!((viewer.name(), viewer.counts()), ("test", before));

    viewer.drop_file(Path::new("absent.glb"));
    wait(&mut viewer, |viewer| viewer.drop_error().is_some());
    assert!(viewer.drop_error().unwrap().contains("absent.glb"), "{:?}", viewer.drop_error());

    // One that takes the place of another before that is loaded, with a setting that changes meanwhile.
    let good = write("good.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    viewer.drop_file(Path::new("absent.glb"));
    viewer.drop_file(&good);
    assert_eq!((viewer.name(), viewer.drop_error()), ("test", None));
    viewer.configure(&ViewerConfig { width: 40, ..*viewer.config() }).unwrap();
    wait(&mut viewer, |viewer| viewer.name() != "test");
    assert!(viewer.name().ends_with("good.obj"), "{}", viewer.name());
    assert_eq!((viewer.counts(), viewer.config().width, viewer.drop_error()), ((1, 1), 40, None));
    assert!(viewer.takes_camera_back() && !viewer.takes_camera_back());
}
