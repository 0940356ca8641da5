//! Public sample models, which lie outside of the repository, on the device.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};

use lvk_gltf::{LoadOptions, Model};
use lvk_samples::app::headless;
use lvk_samples::hybrid::RayPath;
use lvk_tests::rtx_sample::software_device;
use lvk_viewer::light::{Environment, SunSetting};
use lvk_viewer::{Method, Viewer, ViewerConfig, ViewerScene};

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else if path.extension().is_some_and(|extension| extension == "gltf" || extension == "glb") {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// Each model that can be read is shown by both methods, under validation; its animations play, and some of the picture is lit.
#[test]
#[ignore = "needs a folder of models in LVK_GLTF_MODELS: .ci/slow models"]
fn sample_models_are_rendered() {
    let folder = PathBuf::from(std::env::var_os("LVK_GLTF_MODELS").expect("LVK_GLTF_MODELS names no folder"));
    let Some(ctx) = software_device() else { return };
    let mut shown = 0;
    for path in files(&folder) {
        let Ok(model) = Model::load(&path, &LoadOptions::default()) else { continue };
        let animation = model.animations.first().map(|_| 0);
        let scene = ViewerScene {
            name: path.display().to_string(),
            model,
            environment: Environment::day(&SunSetting::default()),
            disc_radius: 0.01,
        };
        for method in [Method::Hybrid, Method::PathTrace] {
            let config =
                ViewerConfig { method, samples: 2, bounces: 4, ..ViewerConfig::new(RayPath::Query, 32, 24) };
            let mut viewer = Viewer::new(&ctx, scene.clone(), &config).unwrap();
            viewer.play(animation, 0.3);
            headless::picture(&mut viewer).unwrap();
            let radiance = viewer.radiance().unwrap();
            assert!(radiance.iter().flatten().all(|value| value.is_finite()), "{}", path.display());
            assert!(radiance.iter().flatten().any(|value| *value > 0.0), "{}", path.display());
        }
        shown += 1;
    }
    println!("{shown} models are shown");
    assert!(shown > 0, "no model in {}", folder.display());
}
