//! The real-time method with ambient occlusion: light that is known in closed form, or by sums in double precision.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use lvk::Context;
use lvk_gltf::{Material, Model};
use lvk_samples::app::headless;
use lvk_samples::app::sample::Sample as _;
use lvk_samples::hybrid::RayPath;
use lvk_samples::scene::Camera;
use lvk_tests::device;
use lvk_tests::rtx_sample::{contexts_and_paths, software_device};
use lvk_viewer::light::{Environment, SunSetting};
use lvk_viewer::{IndirectLight, Method, Viewer, ViewerConfig};

use crate::paths::assert_alike;
use crate::radiance_cache::{dark, lamp, walls};
use crate::scenes::{Builder, View, assert_close, colored, matte, mean, viewer};
use crate::still_life::still_life;

/// Distance up to which surfaces take ambient light from each other, over the diagonal of the scene.
const OCCLUSION_SHARE: f64 = 0.05;

/// Returns the viewer of a model, and has it render with ambient occlusion.
fn occluded(
    (ctx, path): (&Context, RayPath),
    model: &Model,
    environment: &Environment,
    view: &View,
) -> Viewer {
    let mut viewer = viewer(ctx, (Method::Hybrid, path), model, environment, view);
    let indirect = IndirectLight::AmbientOcclusion;
    viewer.configure(&ViewerConfig { indirect, ..*viewer.config() }).unwrap();
    viewer
}

/// Returns the mean of a few pixels around each place on the ground, seen from above.
fn seen_at<const N: usize>(
    ctx: &Context,
    model: &Model,
    environment: &Environment,
    places: [Vec3; N],
) -> [[f64; 3]; N] {
    let above = |place: Vec3| {
        Camera::looking_at((place + Vec3::new(0.02, 2.0, 0.02)).to_array(), place.to_array(), 1.0)
    };
    let view = View { camera: above(places[0]), size: [8, 8], samples: 256 };
    let mut viewer = occluded((ctx, RayPath::Query), model, environment, &view);
    places.map(|place| {
        viewer.set_view(&above(place));
        headless::picture(&mut viewer).unwrap();
        mean(&viewer.radiance().unwrap())
    })
}

/// Ground of 40 x 40 units around the origin.
fn ground(material: Material) -> Builder {
    Builder::default().quad(Vec3::new(-20.0, 0.0, -20.0), Vec3::Z * 40.0, Vec3::X * 40.0, material)
}

#[test]
fn open_surfaces_have_all_light_of_the_sky() {
    let Some(ctx) = software_device() else { return };
    let parts = [
        ("matte ground", matte([0.8, 0.5, 0.3]), [0.8, 0.5, 0.3]),
        ("white plastic", colored([1.0; 3], 0.0, 0.4), [1.0; 3]),
        ("a mirror", colored([1.0; 3], 1.0, 0.0), [1.0; 3]),
        ("rough metal", colored([1.0; 3], 1.0, 0.9), [1.0; 3]),
    ];
    let places = [-15.0, -5.0, 5.0, 15.0].map(|x| Vec3::new(x, 0.0, 0.0));
    let model = parts.iter().zip(places).fold(Builder::default(), |builder, ((_, material, _), place)| {
        let corner = place - Vec3::new(5.0, 0.0, 5.0);
        builder.quad(corner, Vec3::Z * 10.0, Vec3::X * 10.0, material.clone())
    });
    let all = seen_at(&ctx, &model.model(), &Environment::uniform([1.0; 3]), places);
    for ((what, _, expected), light) in parts.into_iter().zip(all) {
        assert_close(what, light, expected, 0.02);
    }
}

/// Mean over all directions that a matte surface prefers of the light that comes to a place one unit before a wall.
fn light_before_a_wall(ambient: f64, occlusion_distance: f64, wall_height: f64) -> f64 {
    const STEPS: u32 = 600;
    let places = (0..STEPS).map(|step| (f64::from(step) + 0.5) / f64::from(STEPS));
    let light = |u: f64, v: f64| {
        let (radius, angle) = (u.sqrt(), 2.0 * PI * v);
        let direction = DVec3::new(radius * angle.cos(), (1.0 - u).sqrt(), radius * angle.sin());
        let distance = if direction.x < 0.0 { -1.0 / direction.x } else { f64::INFINITY };
        let is_hidden = distance * direction.y < wall_height && (distance * direction.z).abs() < 20.0;
        if is_hidden { ambient * (distance / occlusion_distance).min(1.0) } else { 1.0 }
    };
    let sum: f64 = places.clone().map(|u| places.clone().map(|v| light(u, v)).sum::<f64>()).sum();
    sum / f64::from(STEPS).powi(2)
}

#[test]
fn the_sky_is_hidden_by_a_wall_and_near_parts_of_it_return_less() {
    let Some(ctx) = software_device() else { return };
    let model = ground(matte([0.5; 3]))
        .quad(Vec3::new(-1.0, 0.0, -20.0), Vec3::Y * 20.0, Vec3::Z * 40.0, matte([0.5; 3]))
        .model();
    let [light] = seen_at(&ctx, &model, &Environment::uniform([1.0; 3]), [Vec3::ZERO]);
    let diagonal = (2.0 * 40.0_f64.powi(2) + 20.0_f64.powi(2)).sqrt();
    // Half of what comes from outside is scattered.
    let expected = 0.5 * light_before_a_wall(0.5, OCCLUSION_SHARE * diagonal, 20.0);
    assert!(expected < 0.45, "{expected}: the wall hides much");
    assert_close("ground before a wall", light, [expected; 3], 0.02);
}

#[test]
fn a_closed_space_has_the_ambient_light_of_its_lamp() {
    let Some(ctx) = software_device() else { return };
    let (low, high) = (Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 2.5, 2.0));
    let model =
        walls(Builder::default(), low, high, [0.6; 3]).lamp(lamp(3.0), Vec3::new(0.0, 2.2, 0.0)).model();
    let [light] = seen_at(&ctx, &model, &dark(), [Vec3::ZERO]);
    let (flux, area) = (4.0 * PI * 3.0, 2.0 * (4.0 * 2.5 + 2.5 * 4.0 + 4.0 * 4.0));
    let expected = 0.6 * (3.0 / (2.2 * 2.2) + flux / area) / PI;
    assert_close("the middle of the floor", light, [expected; 3], 0.02);
}

#[test]
fn all_paths_of_rays_find_the_same_ambient_light() {
    let Some(ctx) = device() else { return };
    let software = software_device();
    let camera = Camera::looking_at([1.5, 1.7, 4.5], [-0.2, 0.5, 0.0], 40.0);
    let view = View { camera, size: [60, 40], samples: 4 };
    let environment = Environment::day(&SunSetting::default());
    let model = still_life();
    let all: Vec<_> = contexts_and_paths(&ctx, software.as_deref())
        .into_iter()
        .map(|by| {
            let mut viewer = occluded(by, &model, &environment, &view);
            headless::picture(&mut viewer).unwrap();
            (by.1, viewer.radiance().unwrap())
        })
        .collect();
    for (path, other) in &all[1..] {
        assert_alike(&format!("{path:?}"), &all[0].1, other);
    }
}
