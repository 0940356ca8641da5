//! Public sample models, which lie outside of the repository: what becomes of each is in `docs/gltf.md`.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};

use lvk_gltf::{LoadOptions, Model};

const DOCUMENT: &str = include_str!("../../../docs/gltf.md");

fn models(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
        let path = entry.unwrap().path();
        if path.is_dir() {
            models(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "gltf" || extension == "glb") {
            found.push(path);
        }
    }
}

/// Says what becomes of a file: what the scenes show, and the warnings, or the error.
fn outcome(path: &Path, folder: &Path) -> String {
    match Model::load(path, &LoadOptions::default()) {
        Ok(model) => {
            let pose = model.pose(model.animations.first().map(|_| 0), 0.5);
            let placements = (0..model.scenes.len()).flat_map(|scene| model.placements(scene, &pose));
            let triangles = |mesh: usize| {
                model.meshes[mesh].primitives.iter().map(|part| part.triangle_count()).sum::<usize>()
            };
            let triangles: usize = placements.map(|placement| triangles(placement.mesh)).sum();
            let (images, animations) = (model.images.len(), model.animations.len());
            let warnings: Vec<String> = model.warnings.iter().map(|warning| warning.to_string()).collect();
            let warnings =
                if warnings.is_empty() { String::new() } else { format!("; {}", warnings.join("; ")) };
            format!("{triangles} triangles, {images} images, {animations} animations{warnings}")
        }
        Err(error) => format!("refused: {}", error.problem).replace(&format!("{}/", folder.display()), ""),
    }
}

#[test]
#[ignore = "needs a folder of models in LVK_GLTF_MODELS"]
fn sample_models_become_what_the_table_says() {
    let folder = PathBuf::from(std::env::var_os("LVK_GLTF_MODELS").expect("LVK_GLTF_MODELS names no folder"));
    let mut paths = Vec::new();
    models(&folder, &mut paths);
    paths.sort();
    let row = |path: &PathBuf| {
        let name = path.strip_prefix(&folder).unwrap().display().to_string();
        format!("| {name} | {} |", outcome(path, &folder))
    };
    let rows: Vec<String> = paths.iter().map(row).collect();
    let missing: Vec<&String> = rows.iter().filter(|row| !DOCUMENT.contains(row.as_str())).collect();
    assert!(!rows.is_empty() && missing.is_empty(), "not in docs/gltf.md:\n{}", rows.join("\n"));
}

#[test]
#[ignore = "needs a folder of models in LVK_GLTF_CLEAN_MODELS"]
fn sample_models_load_without_a_warning() {
    let folder = std::env::var_os("LVK_GLTF_CLEAN_MODELS").expect("LVK_GLTF_CLEAN_MODELS names no folder");
    let mut paths = Vec::new();
    models(Path::new(&folder), &mut paths);
    let (mut triangles, mut images) = (0, 0);
    for path in &paths {
        let model = Model::load(path, &LoadOptions::default());
        let model = model.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert!(model.warnings.is_empty(), "{}: {:?}", path.display(), model.warnings);
        let parts = model.meshes.iter().flat_map(|mesh| &mesh.primitives);
        triangles += parts.map(|part| part.triangle_count()).sum::<usize>();
        images += model.images.len();
    }
    let figures = format!("{} files, {triangles} triangles and {images} images", paths.len());
    assert!(DOCUMENT.contains(&figures), "not in docs/gltf.md: {figures}");
}
