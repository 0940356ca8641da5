//! The traced scene: triangles and a camera.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::peer::Failure;
use super::workload::Workload;
use crate::synthetic::spheres;
use lvk_samples::app::progress::Progress;
use lvk_samples::scene::{Camera, ObjOptions, Scene};

/// The triangles that the frames of rays see, and their camera.
#[derive(Debug, Clone, PartialEq)]
pub struct RayScene {
    /// Positions of the vertices.
    pub positions: Vec<[f32; 3]>,
    /// Three vertex indices for each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// The constants of the shaders.
    pub view: RayView,
}

/// The constants of the shaders: a ray starts at `eye` and goes through `forward + x * right + y * down`, with x and y from
/// -1 to 1. The fourth numbers of `eye` and `right` are the width and the height of the image in pixels.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct RayView {
    /// Position of the camera, and the width of the image.
    pub eye: [f32; 4],
    /// From the centre of the picture to its right edge, and the height of the image.
    pub right: [f32; 4],
    /// From the centre of the picture to its lower edge.
    pub down: [f32; 4],
    /// From the camera to the centre of the picture.
    pub forward: [f32; 4],
}

impl RayScene {
    /// Loads the scene of the workload, or generates one.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn new(work: &Workload) -> Result<Self, Failure> {
        let Some(path) = &work.scene else {
            let mesh = spheres(work.scene_triangles);
            let view = RayView::new(&mesh.camera, work.image);
            return Ok(Self { positions: mesh.positions, triangles: mesh.triangles, view });
        };
        let scene = Scene::from_obj(path, &ObjOptions::default(), &mut Progress::hidden())?;
        let view = RayView::new(&scene.cameras[0], work.image);
        Ok(Self { positions: scene.positions, triangles: scene.triangles, view })
    }
}

impl RayView {
    fn new(camera: &Camera, [width, height]: [u32; 2]) -> Self {
        let [right, up, forward] = camera.frame().map(Vec3::from);
        let half_height = (0.5 * camera.vertical_fov_degrees.to_radians()).tan();
        let half_width = half_height * width as f32 / height as f32;
        let with = |v: Vec3, w: f32| v.extend(w).to_array();
        Self {
            eye: with(Vec3::from(camera.eye), width as f32),
            right: with(right * half_width, height as f32),
            down: with(-up * half_height, 0.0),
            forward: with(forward, 0.0),
        }
    }
}

/// Returns a number that depends on the result of each ray: a distance, negative for a miss, and the index of a triangle, as
/// eight bytes for each pixel.
#[must_use]
pub fn ray_result(bytes: &[u8]) -> f64 {
    let (pixels, _) = bytes.as_chunks::<8>();
    let hit = |pixel: &&[u8; 8]| f32::from_ne_bytes([pixel[0], pixel[1], pixel[2], pixel[3]]) >= 0.0;
    let index = |pixel: &[u8; 8]| u32::from_ne_bytes([pixel[4], pixel[5], pixel[6], pixel[7]]);
    pixels.iter().filter(hit).map(|pixel| f64::from(index(pixel) % 1000) + 1.0).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hits_and_their_triangles_make_the_result() {
        let pixel = |t: f32, index: u32| [t.to_ne_bytes(), index.to_ne_bytes()].concat();
        let bytes = [pixel(1.0, 4), pixel(-1.0, 9), pixel(0.0, 1002)].concat();
        assert_eq!(ray_result(&bytes), 5.0 + 3.0);
        assert_eq!(ray_result(&pixel(-1.0, 0)), 0.0);
    }

    #[test]
    fn the_generated_scene_lies_in_front_of_its_camera() {
        let scene = RayScene::new(&Workload::QUICK).unwrap();
        assert_eq!(scene.triangles.len(), Workload::QUICK.scene_triangles as usize);
        assert!(scene.triangles.iter().flatten().all(|&index| (index as usize) < scene.positions.len()));
        assert_eq!([scene.view.eye[3], scene.view.right[3]], [32.0, 18.0]);
    }
}
