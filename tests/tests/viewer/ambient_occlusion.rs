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
use crate::scenes::{Builder, View, assert_close, colored, matte, mean, radiance, viewer};
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

/// Half of the sides of the ground, and the height of the wall that stands on it at this place along x, as broad as the ground.
const HALF: f64 = 20.0;
const WALL_HEIGHT: f64 = 20.0;
const WALL_X: f64 = -1.0;

/// Returns the distance of the ground or of the wall along a ray, and its normal.
fn hit(origin: DVec3, direction: DVec3) -> Option<(f64, DVec3)> {
    let ground = (-origin.y / direction.y, DVec3::Y);
    let wall = ((WALL_X - origin.x) / direction.x, DVec3::X);
    let is_there = |(distance, normal): &(f64, DVec3)| {
        let point = origin + *distance * direction;
        let is_on_ground = *normal == DVec3::Y && point.x.abs() <= HALF;
        let is_on_wall = *normal == DVec3::X && (0.0..=WALL_HEIGHT).contains(&point.y);
        *distance > 1e-9 && point.z.abs() <= HALF && (is_on_ground || is_on_wall)
    };
    [ground, wall].into_iter().filter(is_there).min_by(|a, b| a.0.total_cmp(&b.0))
}

/// Returns pairs of numbers from 0 to 1 that are spread evenly.
fn pairs(steps: u32) -> impl Iterator<Item = (f64, f64)> + Clone {
    let place = move |step: u32| (f64::from(step) + 0.5) / f64::from(steps);
    (0..steps).flat_map(move |row| (0..steps).map(move |column| (place(row), place(column))))
}

/// Returns the direction of a pair of numbers among those that a matte surface prefers.
fn matte_direction(normal: DVec3, (u, v): (f64, f64)) -> DVec3 {
    let (radius, angle) = (u.sqrt(), 2.0 * PI * v);
    let (across, along) = normal.any_orthonormal_pair();
    across * radius * angle.cos() + along * radius * angle.sin() + normal * (1.0 - u).sqrt()
}

/// Returns the mean light that comes to a place on the ground. The sky has 1, what hides it `hidden` of its distance.
fn light_on_ground(place: DVec3, hidden: impl Fn(f64) -> f64) -> f64 {
    let light =
        |pair| hit(place, matte_direction(DVec3::Y, pair)).map_or(1.0, |(distance, _)| hidden(distance));
    pairs(600).map(light).sum::<f64>() / 600.0_f64.powi(2)
}

/// Returns the share of what lies around the surfaces that rays from `eye` find, in the mean, that is sky.
fn openness_around(eye: DVec3) -> f64 {
    let (mut surfaces, mut open) = (0_u32, 0.0);
    for (u, v) in pairs(300) {
        let (height, angle) = (1.0 - 2.0 * u, 2.0 * PI * v);
        let radius = (1.0 - height * height).sqrt();
        let direction = DVec3::new(radius * angle.cos(), height, radius * angle.sin());
        let Some((distance, normal)) = hit(eye, direction) else { continue };
        let place = eye + distance * direction;
        let is_sky = |pair: &(f64, f64)| hit(place, matte_direction(normal, *pair)).is_none();
        open += pairs(16).filter(is_sky).count() as f64 / 256.0;
        surfaces += 1;
    }
    open / f64::from(surfaces)
}

#[test]
fn the_sky_is_hidden_by_a_wall_and_near_parts_of_it_return_less() {
    let Some(ctx) = software_device() else { return };
    let reflectance = 0.5;
    let (depth, height) = (2.0 * HALF as f32, WALL_HEIGHT as f32);
    let corner = Vec3::new(WALL_X as f32, 0.0, -HALF as f32);
    let model = ground(matte([reflectance as f32; 3]))
        .quad(corner, Vec3::Y * height, Vec3::Z * depth, matte([reflectance as f32; 3]))
        .model();
    let [light] = seen_at(&ctx, &model, &Environment::uniform([1.0; 3]), [Vec3::ZERO]);
    let openness = openness_around(DVec3::new(0.02, 2.0, 0.02));
    assert!((0.4..0.8).contains(&openness), "{openness}");
    let ambient = reflectance * openness / (1.0 - reflectance * (1.0 - openness));
    let diagonal = (8.0 * HALF.powi(2) + WALL_HEIGHT.powi(2)).sqrt();
    let hidden = |distance: f64| ambient * (distance / (OCCLUSION_SHARE * diagonal)).min(1.0);
    let expected = reflectance * light_on_ground(DVec3::ZERO, hidden);
    assert!(expected < 0.45, "{expected}: the wall hides much");
    assert_close("ground before a wall", light, [expected; 3], 0.02);
}

#[test]
fn a_closed_space_has_the_ambient_light_of_its_lamp() {
    let Some(ctx) = software_device() else { return };
    let (low, high) = (Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 2.5, 2.0));
    let colors = [0.6, 0.2, 0.8];
    let model =
        walls(Builder::default(), low, high, colors).lamp(lamp(3.0), Vec3::new(0.0, 2.2, 0.0)).model();
    let [light] = seen_at(&ctx, &model, &dark(), [Vec3::ZERO]);
    let (flux, area) = (4.0 * PI * 3.0, 2.0 * (4.0 * 2.5 + 2.5 * 4.0 + 4.0 * 4.0));
    // Walls return a share of the lamp's light, of which they return that share, and so on.
    let radiance = |share: f64| share * (3.0 / (2.2 * 2.2) + flux / area * share / (1.0 - share)) / PI;
    assert_close("the middle of the floor", light, colors.map(|share| radiance(f64::from(share))), 0.02);
}

#[test]
fn an_interior_has_about_the_light_of_its_window() {
    let Some(ctx) = software_device() else { return };
    let (low, high) = (Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 2.5, 2.0));
    let size = high - low;
    let [x, y, z] = [Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z];
    // Of the side at the highest x, only the lower two thirds.
    let sides = [(low, x, y), (low, y, z), (low, z, x), (high, -y, -x), (high, -x, -z)];
    let window = (low + x + z, -z, y * (2.0 / 3.0));
    let model = sides.into_iter().chain([window]).fold(Builder::default(), |builder, (corner, u, v)| {
        builder.quad(corner, u, v, matte([0.7, 0.5, 0.3]))
    });
    let camera = Camera::looking_at([1.8, 1.5, 1.8], [-1.0, 1.0, -1.0], 60.0);
    let view = View { camera, size: [24, 16], samples: 64 };
    let (model, white) = (model.model(), Environment::uniform([1.0; 3]));
    let mut viewer = occluded((&ctx, RayPath::Query), &model, &white, &view);
    headless::picture(&mut viewer).unwrap();
    let light = mean(&viewer.radiance().unwrap());
    let reference = mean(&radiance(&ctx, RayPath::Query, &model, &white, &view));
    assert!(reference.iter().all(|channel| (0.005..0.3).contains(channel)), "{reference:?}: little light");
    // One term for all surfaces: those near the window have more light, those far away less.
    assert_close("an interior with a window", light, reference, 0.4);
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
