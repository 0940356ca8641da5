//! Models from files.

use std::cell::{Cell, RefCell};
use std::ops::ControlFlow;
use std::path::Path;

use lvk_gltf::{LoadOptions, Model};
use lvk_samples::app::progress::Progress;
use lvk_samples::scene::{ObjOptions, Scene, SceneError};

use super::obj;

/// Errors of loading a model.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// The glTF file cannot be loaded.
    #[error(transparent)]
    Gltf(#[from] lvk_gltf::Error),
    /// The OBJ file cannot be loaded.
    #[error(transparent)]
    Obj(#[from] SceneError),
    /// The file holds no triangle to show.
    #[error("{file} shows no triangle; export meshes of triangles, in a scene")]
    Empty {
        /// The file.
        file: String,
    },
}

/// Loads a glTF file. The load ends early where nobody waits for it any more.
fn load_gltf(path: &Path, progress: &mut Progress) -> Result<Model, lvk_gltf::Error> {
    let (step, progress) = (Cell::new(""), RefCell::new(progress));
    let on_progress = |at: lvk_gltf::Progress| {
        let mut progress = progress.borrow_mut();
        if step.replace(at.step) != at.step {
            progress.stage(at.step, at.total as u64);
        }
        progress.set(at.done as u64);
        if progress.go_on().is_ok() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    };
    Model::load(path, &LoadOptions { on_progress: Some(&on_progress), ..LoadOptions::default() })
}

/// Loads a glTF file, or an OBJ file where the name ends so.
///
/// # Errors
/// [`ModelError`], which names the file and what is wrong with it.
pub fn load(path: &Path, progress: &mut Progress) -> Result<Model, ModelError> {
    progress.stage("loading the model", 0);
    let is_obj = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj"));
    let model = match is_obj {
        true => obj::model(&Scene::from_obj(path, &ObjOptions::default(), progress)?),
        false => load_gltf(path, progress)?,
    };
    let scene = model.default_scene.unwrap_or(0);
    let placements = model.placements(scene, &model.pose(None, 0.0));
    let triangles =
        |mesh: usize| model.meshes[mesh].primitives.iter().map(|part| part.triangle_count()).sum::<usize>();
    match placements.iter().any(|placement| triangles(placement.mesh) > 0) {
        true => Ok(model),
        false => Err(ModelError::Empty { file: lvk::readable_name(path) }),
    }
}
