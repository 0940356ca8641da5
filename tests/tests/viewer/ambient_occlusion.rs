//! The real-time method with ambient occlusion: light that is known in closed form, or by sums in double precision.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use lvk::Context;
use lvk_gltf::{Material, Model, Transmission};
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
use crate::scenes::{Builder, View, assert_close, colored, config, configured_viewer, matte, mean, radiance};
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
    let indirect = IndirectLight::AmbientOcclusion;
    let config = ViewerConfig { indirect, ..config((Method::Hybrid, path), view) };
    configured_viewer(ctx, &config, model, environment, view)
}

/// Returns the eye that looks at a place on the ground.
fn eye_above(place: Vec3) -> Vec3 {
    place + Vec3::new(0.02, 2.0, 0.02)
}

/// Returns the mean of a few pixels around each place on the ground, seen from above.
fn seen_at<const N: usize>(
    ctx: &Context,
    model: &Model,
    environment: &Environment,
    places: [Vec3; N],
) -> [[f64; 3]; N] {
    let above = |place: Vec3| Camera::looking_at(eye_above(place).to_array(), place.to_array(), 1.0);
    let view = View { camera: above(places[0]), size: [8, 8], samples: 256 };
    let mut viewer = occluded((ctx, RayPath::Query), model, environment, &view);
    places.map(|place| {
        viewer.set_view(&above(place));
        headless::picture(&mut viewer).unwrap();
        mean(&viewer.radiance().unwrap())
    })
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

/// A parallelogram, as `Builder::quad` has it, of a matte colour.
struct Quad {
    corner: Vec3,
    u: Vec3,
    v: Vec3,
    color: [f32; 3],
}

impl Quad {
    fn normal(&self) -> DVec3 {
        self.u.cross(self.v).as_dvec3().normalize()
    }

    /// Returns the distance along a ray; `None` if the ray misses.
    fn distance(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let [corner, u, v] = [self.corner, self.u, self.v].map(|vector| vector.as_dvec3());
        let distance = self.normal().dot(corner - origin) / self.normal().dot(direction);
        let place = origin + distance * direction - corner;
        let is_within = |side: DVec3| (0.0..=1.0).contains(&(place.dot(side) / side.length_squared()));
        (distance > 1e-6 && distance.is_finite() && is_within(u) && is_within(v)).then_some(distance)
    }
}

/// Parallelograms under a sky whose radiance is 1: the reference in double precision.
struct Scene(Vec<Quad>);

impl Scene {
    fn builder(&self) -> Builder {
        let add =
            |builder: Builder, quad: &Quad| builder.quad(quad.corner, quad.u, quad.v, matte(quad.color));
        self.0.iter().fold(Builder::default(), add)
    }

    fn model(&self) -> Model {
        self.builder().model()
    }

    /// Returns the corners of the box around all.
    fn bounds(&self) -> [DVec3; 2] {
        let corners = self.0.iter().flat_map(|Quad { corner, u, v, .. }| [*corner, corner + u, corner + v]);
        let corners: Vec<_> = corners.map(|corner| corner.as_dvec3()).collect();
        [corners.iter().copied().reduce(DVec3::min), corners.iter().copied().reduce(DVec3::max)]
            .map(Option::unwrap)
    }

    fn nearest(&self, origin: DVec3, direction: DVec3) -> Option<(f64, &Quad)> {
        let hits = self.0.iter().filter_map(|quad| Some((quad.distance(origin, direction)?, quad)));
        hits.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Returns the share of the sky that surfaces see, and their reflectance, in the mean over what rays from `eye` find.
    fn around(&self, eye: DVec3) -> (f64, DVec3) {
        const STEPS: u32 = 24;
        let [low, high] = self.bounds();
        let (mut count, mut visibility, mut reflectance) = (0_u32, 0.0, DVec3::ZERO);
        for (x, y) in pairs(STEPS) {
            for z in (0..STEPS).map(|step| (f64::from(step) + 0.5) / f64::from(STEPS)) {
                let direction = (low + (high - low) * DVec3::new(x, y, z) - eye).normalize();
                let Some((distance, quad)) = self.nearest(eye, direction) else { continue };
                let side = -quad.normal().dot(direction).signum() * quad.normal();
                let place = eye + distance * direction + 1e-6 * side;
                let is_sky = |pair: &(f64, f64)| self.nearest(place, matte_direction(side, *pair)).is_none();
                visibility += pairs(12).filter(is_sky).count() as f64 / 144.0;
                reflectance += DVec3::from(quad.color.map(f64::from));
                count += 1;
            }
        }
        (visibility / f64::from(count), reflectance / f64::from(count))
    }

    /// Returns the ambient term at `eye`.
    fn ambient(&self, eye: DVec3) -> DVec3 {
        let (visibility, reflectance) = self.around(eye);
        reflectance * visibility / (1.0 - reflectance * (1.0 - visibility))
    }

    /// Returns the radiance of the ground at a place that is seen from `eye`.
    fn ground_light(&self, place: DVec3, eye: DVec3) -> [f64; 3] {
        let [low, high] = self.bounds();
        let (ambient, reach) = (self.ambient(eye), OCCLUSION_SHARE * low.distance(high));
        let light = |pair| match self.nearest(place, matte_direction(DVec3::Y, pair)) {
            Some((distance, _)) => ambient * (distance / reach).min(1.0),
            None => DVec3::ONE,
        };
        let mean = pairs(400).map(light).sum::<DVec3>() / 400.0_f64.powi(2);
        let (_, ground) = self.nearest(place + DVec3::Y, DVec3::NEG_Y).unwrap();
        (mean * DVec3::from(ground.color.map(f64::from))).to_array()
    }
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

#[test]
fn the_sky_is_hidden_by_a_wall_and_near_parts_of_it_return_less() {
    let Some(ctx) = software_device() else { return };
    let (far, depth) = (20.0, Vec3::Z * 40.0);
    let ground =
        Quad { corner: Vec3::new(-far, 0.0, -far), u: depth, v: Vec3::X * 40.0, color: [0.5, 0.8, 0.2] };
    let wall =
        Quad { corner: Vec3::new(-1.0, 0.0, -far), u: Vec3::Y * far, v: depth, color: [0.5, 0.1, 0.9] };
    let scene = Scene(vec![ground, wall]);
    let [light] = seen_at(&ctx, &scene.model(), &Environment::uniform([1.0; 3]), [Vec3::ZERO]);
    let expected = scene.ground_light(DVec3::ZERO, eye_above(Vec3::ZERO).as_dvec3());
    assert!(expected[0] < 0.45, "{expected:?}: the wall hides much");
    assert_close("ground before a wall", light, expected, 0.02);
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

/// An interior whose side at the highest x is open above a sill.
fn with_window(sill: f32) -> Scene {
    let (low, high) = (Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 2.5, 2.0));
    let size = high - low;
    let [x, y, z] = [Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z];
    let color = [0.7, 0.5, 0.3];
    let sides = [(low, x, y), (low, y, z), (low, z, x), (high, -y, -x), (high, -x, -z)];
    let below = (low + x + z, -z, Vec3::Y * sill);
    Scene(sides.into_iter().chain([below]).map(|(corner, u, v)| Quad { corner, u, v, color }).collect())
}

#[test]
fn an_interior_has_about_the_light_of_its_window() {
    let Some(ctx) = software_device() else { return };
    let (scene, white) = (with_window(1.7), Environment::uniform([1.0; 3]));
    let model = scene.model();
    // Close to the sill, where little of the window is seen.
    let place = Vec3::new(1.5, 0.0, 0.0);
    let [light] = seen_at(&ctx, &model, &white, [place]);
    let expected = scene.ground_light(place.as_dvec3(), eye_above(place).as_dvec3());
    // About 800 rays of the probe find the sky, so it is known to a few percent.
    assert_close("the floor below the window", light, expected, 0.08);

    let camera = Camera::looking_at([1.8, 1.5, 1.8], [-1.0, 1.0, -1.0], 60.0);
    let view = View { camera, size: [24, 16], samples: 64 };
    let mut viewer = occluded((&ctx, RayPath::Query), &model, &white, &view);
    headless::picture(&mut viewer).unwrap();
    let light = mean(&viewer.radiance().unwrap());
    let reference = mean(&radiance(&ctx, RayPath::Query, &model, &white, &view));
    assert!(reference.iter().all(|channel| (0.005..0.3).contains(channel)), "{reference:?}: little light");
    // One term for all surfaces: those near the window have more light, those far away less.
    assert_close("an interior with a window", light, reference, 0.4);
}

#[test]
fn a_glass_pane_is_no_wall() {
    let Some(ctx) = software_device() else { return };
    let place = Vec3::new(1.5, 0.0, 0.0);
    let white = Environment::uniform([1.0; 3]);
    let open = with_window(1.7).model();
    let transmission = Some(Transmission { factor: 1.0, texture: None });
    let pane = Material { transmission, roughness: 0.0, ..matte([1.0; 3]) };
    let corner = Vec3::new(2.0, 1.7, 2.0);
    let glazed = with_window(1.7).builder().quad(corner, Vec3::NEG_Z * 4.0, Vec3::Y * 0.8, pane).model();
    let [expected] = seen_at(&ctx, &open, &white, [place]);
    let [light] = seen_at(&ctx, &glazed, &white, [place]);
    assert_close("the floor below a glazed window", light, expected, 0.1);
}

#[test]
fn light_of_a_lamp_behind_a_pane_counts_once() {
    let Some(ctx) = software_device() else { return };
    let glowing = Material { emissive: [1.0; 3], emissive_strength: 8.0, ..matte([0.0; 3]) };
    let transmission = Some(Transmission { factor: 1.0, texture: None });
    let pane = Material { transmission, roughness: 0.0, ..matte([1.0; 3]) };
    let (far, wide) = (Vec3::new(-20.0, 0.0, -20.0), 40.0);
    let lamp = |builder: Builder| {
        // It glows downwards and upwards, and stands beside the eye.
        builder.quad(Vec3::new(0.5, 1.5, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0, glowing.clone())
    };
    let ground = |builder: Builder| builder.quad(far, Vec3::Z * wide, Vec3::X * wide, matte([0.5; 3]));
    let bare = lamp(ground(Builder::default())).model();
    let behind = lamp(ground(Builder::default()))
        .quad(Vec3::new(0.3, 1.2, -3.0), Vec3::X * 6.0, Vec3::Z * 6.0, pane)
        .model();
    let place = Vec3::new(0.0, 0.0, 0.0);
    let [expected] = seen_at(&ctx, &bare, &dark(), [place]);
    let [light] = seen_at(&ctx, &behind, &dark(), [place]);
    assert!(expected[0] > 0.1, "{expected:?}: the lamp lights the ground");
    assert_close("ground below a lamp behind a pane", light, expected, 0.02);
}

#[test]
fn the_ambient_term_follows_the_eye() {
    let Some(ctx) = software_device() else { return };
    // Two closed spaces, side by side: a pale one and a dark one.
    let (pale, dark_place) = (Vec3::ZERO, Vec3::new(10.0, 0.0, 0.0));
    let around = |builder: Builder, middle: Vec3, share: f32| {
        let half = Vec3::new(2.0, 0.0, 2.0);
        walls(builder, middle - half, middle + half + Vec3::Y * 2.5, [share; 3])
            .lamp(lamp(3.0), middle + Vec3::Y * 2.3)
    };
    let model = around(around(Builder::default(), pale, 0.8), dark_place, 0.1).model();
    let above = |place: Vec3| Camera::looking_at(eye_above(place).to_array(), place.to_array(), 1.0);
    let view = View { camera: above(pale), size: [8, 8], samples: 64 };
    let mut viewer = occluded((&ctx, RayPath::Query), &model, &dark(), &view);
    // As in a window: each frame goes on from the one before.
    viewer.configure(&ViewerConfig { is_progressive: true, ..*viewer.config() }).unwrap();
    let mut seen = |place: Vec3| {
        viewer.set_view(&above(place));
        (0..64).for_each(|_| drop(headless::picture(&mut viewer).unwrap()));
        mean(&viewer.radiance().unwrap())
    };
    let found = [seen(pale), seen(dark_place), seen(pale)];
    let [first, moved] = seen_at(&ctx, &model, &dark(), [pale, dark_place]);
    assert!(first[0] > 2.0 * moved[0], "{first:?} and {moved:?}");
    for (light, expected) in found.into_iter().zip([first, moved, first]) {
        assert_close("after a move", light, expected, 0.03);
    }
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
