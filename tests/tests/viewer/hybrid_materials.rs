//! Each material of the features table by the real-time method, against the path tracer.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use glam::Vec3;
use lvk_gltf::{
    AlphaMode, Anisotropy, Clearcoat, Iridescence, Material, Sheen, Specular, Transmission, Volume,
};
use lvk_samples::hybrid::RayPath;
use lvk_samples::scene::Camera;
use lvk_tests::rtx_sample::software_device;
use lvk_viewer::Method;
use lvk_viewer::light::{Environment, SunSetting};

use crate::scenes::{Builder, View, assert_close, colored, mean, radiance_by};

/// Blocks in a row and in a column, a block apart.
const SIDE: usize = 4;
const SIZE: [u32; 2] = [112, 112];

fn plastic() -> Material {
    colored([0.6, 0.3, 0.2], 0.0, 0.5)
}

fn metal() -> Material {
    colored([0.9, 0.7, 0.4], 1.0, 0.3)
}

fn glass() -> Material {
    let transmission = Some(Transmission { factor: 1.0, texture: None });
    Material { transmission, ..colored([0.9, 0.95, 1.0], 0.0, 0.1) }
}

/// One material for each row of the table, and the share by which its light may differ. What covers by chance shows a pixel one surface
/// now and another one then, whose light the filter takes from pixels around.
fn materials() -> [(&'static str, Material, f64); SIDE * SIDE] {
    let specular = Specular { factor: 1.0, texture: None, color: [0.4, 0.8, 2.0], color_texture: None };
    let coat = Clearcoat {
        factor: 1.0,
        texture: None,
        roughness: 0.2,
        roughness_texture: None,
        normal_texture: None,
        normal_scale: 1.0,
    };
    let sheen =
        Sheen { color: [0.8, 0.6, 0.9], color_texture: None, roughness: 0.4, roughness_texture: None };
    let volume = |attenuation_distance| Volume {
        thickness: 1.0,
        thickness_texture: None,
        attenuation_distance,
        attenuation_color: [0.3, 0.8, 0.5],
    };
    let brushed = Anisotropy { strength: 0.7, rotation: 0.5, texture: None };
    let film = Iridescence {
        factor: 1.0,
        texture: None,
        ior: 1.4,
        thickness_min: 100.0,
        thickness_max: 450.0,
        thickness_texture: None,
    };
    let through = |alpha_mode, alpha| Material {
        alpha_mode,
        base_color: [0.2, 0.4, 0.8, alpha],
        double_sided: true,
        ..plastic()
    };
    let glowing = Material { emissive: [0.2, 0.6, 1.0], emissive_strength: 3.0, ..plastic() };
    [
        ("plastic", plastic(), 0.03),
        ("rough metal", Material { roughness: 0.8, ..metal() }, 0.03),
        ("metal", metal(), 0.03),
        ("an index of 2.2", Material { ior: 2.2, ..plastic() }, 0.03),
        ("a blue reflection", Material { specular: Some(specular), ..plastic() }, 0.03),
        ("a clear coat", Material { clearcoat: Some(coat), ..plastic() }, 0.03),
        ("cloth", Material { sheen: Some(sheen), ..plastic() }, 0.03),
        ("a pane", glass(), 0.08),
        ("glass", Material { volume: Some(volume(f32::INFINITY)), ..glass() }, 0.03),
        ("glass that absorbs", Material { volume: Some(volume(0.4)), ..glass() }, 0.12),
        ("a glowing block", glowing, 0.03),
        ("unlit", Material { unlit: true, ..plastic() }, 0.001),
        ("brushed metal", Material { anisotropy: Some(brushed), ..metal() }, 0.03),
        ("a thin film", Material { iridescence: Some(film), ..metal() }, 0.03),
        ("a mask", through(AlphaMode::Mask { cutoff: 0.5 }, 0.4), 0.05),
        ("a veil", through(AlphaMode::Blend, 0.4), 0.25),
    ]
}

/// The middle of the upper face of a block.
fn middle(number: usize) -> Vec3 {
    let place = |of: usize| 2.0 * (of as f32 - 0.5 * (SIDE as f32 - 1.0));
    Vec3::new(place(number % SIDE), 0.4, place(number / SIDE))
}

/// The pixel that shows a point.
fn pixel(camera: &Camera, point: Vec3) -> [usize; 2] {
    let [right, up, forward] = camera.frame().map(Vec3::from);
    let away = point - Vec3::from(camera.eye);
    let half = (0.5 * camera.vertical_fov_degrees).to_radians().tan() * away.dot(forward);
    let at = |along: f32, side: u32| (0.5 * (1.0 + along / half) * side as f32) as usize;
    [at(away.dot(right), SIZE[0]), at(-away.dot(up), SIZE[1])]
}

/// The mean radiance in the middle of the upper face of a block.
fn face(camera: &Camera, number: usize, radiance: &[[f32; 3]]) -> [f64; 3] {
    let [x, y] = pixel(camera, middle(number));
    let rows = (y - 2..=y + 2).map(|y| y * SIZE[0] as usize + x);
    let pixels: Vec<_> = rows.flat_map(|at| &radiance[at - 2..=at + 2]).copied().collect();
    mean(&pixels)
}

#[test]
fn every_material_of_the_table_has_the_light_of_the_reference() {
    let Some(ctx) = software_device() else { return };
    let materials = materials();
    let floor = Builder::default().quad(
        Vec3::new(-20.0, 0.0, -20.0),
        Vec3::Z * 40.0,
        Vec3::X * 40.0,
        colored([0.5; 3], 0.0, 1.0),
    );
    let model = materials.iter().enumerate().fold(floor, |builder, (number, (_, material, _))| {
        let (low, high) = (Vec3::new(-0.5, -0.35, -0.5), Vec3::new(0.5, 0.0, 0.5));
        builder.cuboid(middle(number) + low, middle(number) + high, material)
    });
    let model = model.model();
    let camera = Camera::looking_at([4.0, 14.0, 9.0], [0.0, 0.4, 0.0], 30.0);
    let day = Environment::day(&SunSetting::default());
    // Sunlight through rough glass is a caustic, whose bright paths the real-time method bounds.
    for environment in [Environment { sun: None, ..day.clone() }, day] {
        let shown = |method, samples| {
            let view = View { camera, size: SIZE, samples };
            radiance_by(&ctx, (method, RayPath::Query), &model, &environment, &view)
        };
        let (hybrid, reference) = (shown(Method::Hybrid, 64), shown(Method::PathTrace, 512));
        let is_compared = |material: &Material| environment.sun.is_none() || material.transmission.is_none();
        for (number, (name, material, share)) in materials.iter().enumerate() {
            if is_compared(material) {
                let [hybrid, reference] =
                    [&hybrid, &reference].map(|radiance| face(&camera, number, radiance));
                assert_close(name, hybrid, reference, *share);
            }
        }
    }
}
