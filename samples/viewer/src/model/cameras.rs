//! Cameras of a model: those of its nodes, and one that shows all of it.

use glam::{Mat4, Vec3};
use lvk_gltf::{Bounds, Model, Pose, Projection};
use lvk_samples::scene::Camera;

/// The camera's name where the model has none of its own.
pub const OVERVIEW: &str = "overview";
/// Vertical field of view of the overview in degrees.
const OVERVIEW_FOV: f32 = 38.0;
/// Where the overview looks from, as seen from the middle of the model.
const OVERVIEW_FROM: Vec3 = Vec3::new(0.55, 0.38, 1.0);

/// A camera and its name.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelCamera {
    /// Name in the file, else `camera` and its number; `overview` for the one that sees the whole model.
    pub name: String,
    /// The camera.
    pub camera: Camera,
}

/// Returns the cameras of the nodes of a scene, then the overview. Parallel projections become perspectives from far away.
#[must_use]
pub fn cameras(model: &Model, scene: usize, pose: &Pose) -> Vec<ModelCamera> {
    cameras_around(model, scene, pose, &bounds(model, scene, pose))
}

/// The box around a scene in a pose; around the origin where it shows nothing.
pub(crate) fn bounds(model: &Model, scene: usize, pose: &Pose) -> Bounds {
    model.bounds(scene, pose).unwrap_or(Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE })
}

/// As [`cameras`], of a scene in a box that is known.
pub(crate) fn cameras_around(model: &Model, scene: usize, pose: &Pose, bounds: &Bounds) -> Vec<ModelCamera> {
    let mut all = Vec::new();
    for node in model.scene_nodes(scene) {
        let camera = model.nodes[node].camera.and_then(|camera| model.cameras.get(camera));
        let Some((camera, world)) = camera.zip(pose.world.get(node)) else { continue };
        let names = [&camera.name, &model.nodes[node].name];
        let name = names.into_iter().flatten().next().cloned();
        let name = name.unwrap_or_else(|| format!("camera {}", all.len() + 1));
        all.push(ModelCamera { name, camera: placed(&camera.projection, world, bounds) });
    }
    all.push(ModelCamera { name: OVERVIEW.to_owned(), camera: overview(bounds) });
    all
}

/// A camera that shows a box.
fn overview(bounds: &Bounds) -> Camera {
    let middle = 0.5 * (bounds.min + bounds.max);
    let radius = (0.5 * bounds.min.distance(bounds.max)).max(1e-6);
    let distance = radius / (0.5 * OVERVIEW_FOV).to_radians().sin();
    let eye = middle + OVERVIEW_FROM.normalize() * distance;
    Camera::looking_at(eye.to_array(), middle.to_array(), OVERVIEW_FOV)
}

/// A camera of a node, which looks along its -z.
fn placed(projection: &Projection, world: &Mat4, bounds: &Bounds) -> Camera {
    let eye = world.w_axis.truncate();
    let forward = world.transform_vector3(Vec3::NEG_Z).try_normalize().unwrap_or(Vec3::NEG_Z);
    let up = world.transform_vector3(Vec3::Y).try_normalize().unwrap_or(Vec3::Y);
    let middle = 0.5 * (bounds.min + bounds.max);
    // The point to turn around is as far away as the middle of the model.
    let distance = forward.dot(middle - eye).max(1e-3 * bounds.min.distance(bounds.max)).max(1e-6);
    let target = (eye + forward * distance).to_array();
    let looking =
        |eye: Vec3, fov| Camera { eye: eye.to_array(), target, up: up.to_array(), vertical_fov_degrees: fov };
    match *projection {
        Projection::Perspective { yfov, .. } => looking(eye, yfov.to_degrees()),
        Projection::Orthographic { ymag, .. } => {
            const FOV: f32 = 5.0;
            let away = ymag / (0.5 * FOV).to_radians().tan();
            looking(eye - forward * (away - distance), FOV)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_overview_sees_all_corners() {
        let bounds = Bounds { min: Vec3::new(-3.0, 0.0, -1.0), max: Vec3::new(2.0, 1.0, 4.0) };
        let camera = overview(&bounds);
        let clip = camera.clip_from_view(1.0, 0.01, 100.0) * camera.view_from_world();
        for corner in 0..8 {
            let pick =
                |axis: usize| if corner >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
            let place = clip.project_point3(Vec3::new(pick(0), pick(1), pick(2)));
            assert!(place.x.abs() <= 1.0 && place.y.abs() <= 1.0, "{place}");
        }
    }

    #[test]
    fn cameras_of_nodes_come_first_and_look_along_their_axis() {
        let mut model = crate::model::showcase();
        model.cameras.push(lvk_gltf::Camera {
            name: Some("front".into()),
            projection: Projection::Perspective { yfov: 1.0, aspect_ratio: None, znear: 0.1, zfar: None },
        });
        let transform = lvk_gltf::Transform::Matrix(Mat4::from_translation(Vec3::new(0.0, 1.0, 9.0)));
        let node = lvk_gltf::Node { camera: Some(model.cameras.len() - 1), transform, ..Default::default() };
        model.nodes.push(node);
        let number = model.nodes.len() - 1;
        model.scenes[0].roots.push(number);
        let all = cameras(&model, 0, &model.pose(None, 0.0));
        let front = all.iter().find(|camera| camera.name == "front").unwrap();
        let [x, y, z] = front.camera.frame()[2];
        assert_eq!((x, y, z), (0.0, 0.0, -1.0));
        assert_eq!(all.last().unwrap().name, OVERVIEW);
    }
}
