//! A camera as shaders know it.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::Camera;

lvk::shader_struct! {
    /// Bytes by which the shaders know a camera (`shaders/common/camera.glsl`).
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub struct GpuCamera {
        eye: [f32; 3],
        near_plane: f32,
        forward: [f32; 3],
        pixel_spread: f32,
        right: [f32; 3],
        width: u32,
        down: [f32; 3],
        height: u32,
        clip_right: [f32; 3],
        clip_down: [f32; 3],
        shift: [f32; 2],
    }
}

impl GpuCamera {
    /// The camera of a picture of `width` times `height` pixels. `near_plane` is in scene units.
    #[must_use]
    pub fn new(camera: &Camera, width: u32, height: u32, near_plane: f32) -> Self {
        let [right, up, forward] = camera.frame().map(Vec3::from);
        let half_height = (0.5 * camera.vertical_fov_degrees.to_radians()).tan();
        let right = right * (half_height * width as f32 / height as f32);
        let down = -up * half_height;
        Self {
            eye: camera.eye,
            near_plane,
            forward: forward.to_array(),
            pixel_spread: 2.0 * half_height / height as f32,
            right: right.to_array(),
            width,
            down: down.to_array(),
            height,
            clip_right: (right / right.length_squared()).to_array(),
            clip_down: (down / down.length_squared()).to_array(),
            shift: [0.0; 2],
        }
    }

    /// Growth of a pixel's footprint per unit of distance.
    #[must_use]
    pub fn pixel_spread(&self) -> f32 {
        self.pixel_spread
    }

    /// Cameras of the six faces of a cube map that is drawn from `eye`, with `size` pixels a side, in Vulkan's order of faces.
    /// They look at the cube from inside, as samplers do: left and right are those of a mirror.
    pub(crate) fn cube_faces(eye: [f32; 3], size: u32, near_plane: f32) -> [Self; 6] {
        use glam::Vec3 as V;
        // Forward, right and down of each face: the specification's major axis, s and t.
        let faces = [
            [V::X, V::NEG_Z, V::NEG_Y],
            [V::NEG_X, V::Z, V::NEG_Y],
            [V::Y, V::X, V::Z],
            [V::NEG_Y, V::X, V::NEG_Z],
            [V::Z, V::X, V::NEG_Y],
            [V::NEG_Z, V::NEG_X, V::NEG_Y],
        ];
        faces.map(|axes| {
            let [forward, right, down] = axes.map(|axis| axis.to_array());
            Self {
                eye,
                near_plane,
                forward,
                pixel_spread: 2.0 / size as f32,
                right,
                width: size,
                down,
                height: size,
                clip_right: right,
                clip_down: down,
                shift: [0.0; 2],
            }
        })
    }

    /// The same camera for sample `number` of `count`: evenly spread over each pixel, the only one in the middle.
    #[must_use]
    pub fn for_sample(self, number: u32, count: u32) -> Self {
        if count <= 1 {
            return self;
        }
        // The steps of the R2 sequence, which fills the plane evenly however many are taken.
        let place = |ratio: f64| ((0.5 + ratio * f64::from(number)).fract() - 0.5) as f32;
        let [x, y] = [place(0.754_877_666_246_693), place(0.569_840_290_998_053)];
        Self { shift: [2.0 * x / self.width as f32, 2.0 * y / self.height as f32], ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera::looking_at([1.0, 2.0, 3.0], [4.0, 1.0, -2.0], 60.0)
    }

    fn direction(camera: &GpuCamera, ndc: [f32; 2]) -> Vec3 {
        Vec3::from(camera.forward) + ndc[0] * Vec3::from(camera.right) + ndc[1] * Vec3::from(camera.down)
    }

    #[test]
    fn rays_and_clip_space_agree() {
        let gpu = GpuCamera::new(&camera(), 1280, 720, 0.1);
        for ndc in [[0.0, 0.0], [0.7, -0.3], [-1.0, 1.0]] {
            let offset = 3.5 * direction(&gpu, ndc);
            let w = offset.dot(Vec3::from(gpu.forward));
            assert!((offset.dot(Vec3::from(gpu.clip_right)) / w - ndc[0]).abs() < 1e-5);
            assert!((offset.dot(Vec3::from(gpu.clip_down)) / w - ndc[1]).abs() < 1e-5);
        }
    }

    #[test]
    fn rays_and_the_scenes_own_matrices_agree() {
        let gpu = GpuCamera::new(&camera(), 1280, 720, 0.1);
        let clip_from_world =
            camera().clip_from_view(1280.0 / 720.0, 0.1, 100.0) * camera().view_from_world();
        let point = Vec3::from(camera().eye) + 7.0 * direction(&gpu, [0.4, -0.8]);
        let clip = clip_from_world.project_point3(point);
        assert!((clip.x - 0.4).abs() < 1e-4 && (clip.y + 0.8).abs() < 1e-4, "{clip}");
    }

    /// The face and the place on it, from -1 to 1, that the specification of Vulkan gives a direction.
    fn face_of(direction: Vec3) -> (usize, [f32; 2]) {
        let Vec3 { x, y, z } = direction;
        let largest = direction.abs().max_element();
        let (face, s, t) = if x.abs() == largest {
            if x > 0.0 { (0, -z, -y) } else { (1, z, -y) }
        } else if y.abs() == largest {
            if y > 0.0 { (2, x, z) } else { (3, x, -z) }
        } else if z > 0.0 {
            (4, x, -y)
        } else {
            (5, -x, -y)
        };
        (face, [s / largest, t / largest])
    }

    #[test]
    fn faces_of_cubes_are_where_samplers_look_for_them() {
        for (number, face) in GpuCamera::cube_faces([1.0, 2.0, 3.0], 16, 0.1).iter().enumerate() {
            for ndc in [[0.0, 0.0], [0.7, -0.3], [-0.9, 0.5]] {
                let (found, place) = face_of(direction(face, ndc));
                assert_eq!(found, number);
                assert!((place[0] - ndc[0]).abs() + (place[1] - ndc[1]).abs() < 1e-6, "{number}: {place:?}");
            }
        }
    }

    #[test]
    fn samples_stay_in_their_pixel_and_differ() {
        let gpu = GpuCamera::new(&camera(), 100, 50, 0.1);
        let all: Vec<_> = (0..16).map(|number| gpu.for_sample(number, 16).shift).collect();
        for (number, [x, y]) in all.iter().enumerate() {
            assert!(x.abs() <= 0.01 && y.abs() <= 0.02);
            assert!(all[..number].iter().all(|other| other != &[*x, *y]));
        }
        assert_eq!(gpu.for_sample(0, 1).shift, [0.0; 2]);
    }

    #[test]
    fn the_layout_is_the_shaders_scalar_one() {
        assert_eq!(size_of::<GpuCamera>(), 96);
    }
}
