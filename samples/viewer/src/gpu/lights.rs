//! Lights of a model and of its environment as shaders read them.

use std::f64::consts::PI;

use glam::{DVec3, Mat4, Vec3};
use lvk_gltf::{Bounds, LightKind, Model, Pose};

use super::emitters::Emitters;
use super::layout::{AmbientConstants, EmissionConstants, GpuLight, light_kind};
use crate::light::{Environment, Sun, luminance};

/// Lights, discs first, with the probabilities of them and of the sky.
pub(crate) struct GpuLights {
    pub(crate) lights: Vec<GpuLight>,
    pub(crate) disc_count: u32,
    pub(crate) sky_probability: f32,
    pub(crate) emission: EmissionConstants,
    pub(crate) ambient: AmbientConstants,
}

/// The share of samples that a source of light gets at least, over its even share.
const LEAST_SHARE: f64 = 0.25;

/// What lights of a scene depend on beside its nodes.
#[derive(Debug, Clone)]
pub(crate) struct LightSetting {
    sun: Option<Sun>,
    /// Irradiance that the sky gives.
    sky: DVec3,
    /// Radius of the discs of directional lights, in radians.
    disc_radius: f32,
    bounds: Bounds,
}

impl LightSetting {
    /// A model with directional lights of its own needs no sun.
    pub(crate) fn new(model: &Model, environment: &Environment, disc_radius: f32, bounds: Bounds) -> Self {
        let sky = environment.sky.mean() * PI;
        let has_sun = model.lights.iter().any(|light| light.kind == LightKind::Directional);
        Self { sun: environment.sun.filter(|_| !has_sun), sky, disc_radius, bounds }
    }
}

impl GpuLights {
    /// The sun, the lights of the nodes of a scene, and its triangles that glow.
    pub(crate) fn new(
        (model, scene): (&Model, usize),
        pose: &Pose,
        emitters: &Emitters,
        setting: &LightSetting,
    ) -> Self {
        let mut discs: Vec<GpuLight> = setting.sun.iter().map(disc).collect();
        let mut lamps = Vec::new();
        for node in model.scene_nodes(scene) {
            let light = model.nodes[node].light.and_then(|light| model.lights.get(light));
            let Some((light, world)) = light.zip(pose.world.get(node)) else { continue };
            match light.kind {
                LightKind::Directional => discs.push(directional(light, world, setting.disc_radius)),
                LightKind::Point | LightKind::Spot { .. } => lamps.push(lamp(light, world)),
            }
        }
        let disc_count = discs.len() as u32;
        let mut lights = [discs, lamps].concat();
        let [emitter_probability, sky_probability] =
            choose(&mut lights, [emitters.power, luminance(setting.sky)], &setting.bounds);
        let emission = EmissionConstants {
            emitter_count: emitters.triangles.len() as u32,
            emitter_probability,
            emitter_power: emitters.power as f32,
        };
        let ambient = ambient(&lights, emitters.light, setting);
        Self { lights, disc_count, sky_probability, emission, ambient }
    }
}

/// The irradiance of surfaces, in the mean. Lamps, and emitters whose areas times radiances are `emitters`, light the sides of the box around
/// the scene. The sky and discs light surfaces of all directions.
fn ambient(lights: &[GpuLight], emitters: DVec3, setting: &LightSetting) -> AmbientConstants {
    let (discs, lamps): (Vec<&GpuLight>, Vec<_>) =
        lights.iter().partition(|light| light.kind == light_kind::DISC);
    let color = |light: &GpuLight| Vec3::from(light.color).as_dvec3();
    let flux = PI * emitters + lamps.iter().map(|lamp| solid_angle(lamp) * color(lamp)).sum::<DVec3>();
    let extent = (setting.bounds.max - setting.bounds.min).as_dvec3();
    let area = 2.0 * extent.dot(DVec3::new(extent.y, extent.z, extent.x));
    let lamp_irradiance = if area > 0.0 { flux / area } else { DVec3::ZERO };
    // A quarter is the mean of the cosine over all directions, of which half have none.
    let unoccluded_irradiance = setting.sky + 0.25 * discs.into_iter().map(color).sum::<DVec3>();
    AmbientConstants {
        lamp_irradiance: lamp_irradiance.as_vec3().to_array(),
        unoccluded_irradiance: unoccluded_irradiance.as_vec3().to_array(),
        box_min: setting.bounds.min.to_array(),
        box_max: setting.bounds.max.to_array(),
    }
}

/// The flux of a lamp over its radiant intensity in the middle: of a spot, the integral of `lampIrradiance` of the shaders over its cone,
/// without its range.
fn solid_angle(lamp: &GpuLight) -> f64 {
    let (outer, inner) = (f64::from(lamp.cone), f64::from(lamp.cos_inner));
    let share = if lamp.kind == light_kind::SPOT { 1.0 - inner + (inner - outer) / 3.0 } else { 2.0 };
    2.0 * PI * share
}

/// Sets the probabilities of lights by the light that they bring about the middle of the scene. Returns those of emitters, which
/// have that radiant intensity, and of the sky, which has that irradiance.
fn choose(lights: &mut [GpuLight], [emitters, sky]: [f64; 2], bounds: &Bounds) -> [f32; 2] {
    let middle = 0.5 * (bounds.min + bounds.max);
    let near = (0.25 * bounds.min.distance_squared(bounds.max)).max(1e-12);
    let brightness = |light: &GpuLight| {
        let bright = luminance(Vec3::from(light.color).as_dvec3());
        match light.kind {
            light_kind::DISC => bright,
            _ => bright / f64::from(middle.distance_squared(light.position.into()).max(near)),
        }
    };
    let all: Vec<f64> = lights.iter().map(brightness).chain([emitters / f64::from(near), sky]).collect();
    let (sum, count) = (all.iter().sum::<f64>(), all.iter().filter(|bright| **bright > 0.0).count());
    let weight = |bright: &f64| {
        if *bright > 0.0 { bright / sum + LEAST_SHARE / count as f64 } else { 0.0 }
    };
    let weights: Vec<f64> = all.iter().map(weight).collect();
    let total = weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    for (light, weight) in lights.iter_mut().zip(&weights) {
        light.probability = (weight / total) as f32;
    }
    let [.., emitters, sky] = weights[..] else { return [0.0; 2] };
    [emitters, sky].map(|weight| (weight / total) as f32)
}

fn disc(sun: &Sun) -> GpuLight {
    // Half of the sine of half the angle, squared: 1 - cosine without a difference of nearly equal numbers.
    let half = (0.5 * f64::from(sun.radius)).sin();
    GpuLight {
        position: sun.direction,
        kind: light_kind::DISC,
        color: sun.irradiance,
        cone: (2.0 * half * half) as f32,
        ..bytemuck::Zeroable::zeroed()
    }
}

fn directional(light: &lvk_gltf::Light, world: &Mat4, radius: f32) -> GpuLight {
    let direction = -along(world);
    let irradiance = Vec3::from(light.color) * light.intensity;
    disc(&Sun { direction: direction.to_array(), irradiance: irradiance.to_array(), radius })
}

fn lamp(light: &lvk_gltf::Light, world: &Mat4) -> GpuLight {
    let (kind, cone, cos_inner) = match light.kind {
        LightKind::Spot { inner_cone_angle, outer_cone_angle } => {
            (light_kind::SPOT, outer_cone_angle.cos(), inner_cone_angle.cos())
        }
        LightKind::Point | LightKind::Directional => (light_kind::POINT, 0.0, 0.0),
    };
    GpuLight {
        position: world.w_axis.truncate().to_array(),
        kind,
        color: (Vec3::from(light.color) * light.intensity).to_array(),
        probability: 0.0,
        direction: along(world).to_array(),
        cone,
        cos_inner,
        range: light.range.unwrap_or(0.0),
    }
}

/// The direction that a light of a node shines along.
fn along(world: &Mat4) -> Vec3 {
    let direction: DVec3 = world.transform_vector3(Vec3::NEG_Z).as_dvec3();
    direction.try_normalize().map_or(Vec3::NEG_Y, |direction| direction.as_vec3())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_sum_up_to_one_and_follow_the_light() {
        let bounds = Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE };
        let lit = |color: [f32; 3], position: [f32; 3]| GpuLight {
            kind: light_kind::POINT,
            color,
            position,
            ..bytemuck::Zeroable::zeroed()
        };
        let mut lights =
            vec![lit([8.0; 3], [0.0; 3]), lit([8.0; 3], [100.0, 0.0, 0.0]), lit([0.0; 3], [0.0; 3])];
        let [emitters, sky] = choose(&mut lights, [0.5, 1.0], &bounds);
        assert!(emitters > 0.05 && sky > 0.05);
        let sum: f32 = lights.iter().map(|light| light.probability).sum::<f32>() + emitters + sky;
        assert!((sum - 1.0).abs() < 1e-6);
        assert!(lights[0].probability > lights[1].probability && lights[1].probability > 0.05);
        assert_eq!(lights[2].probability, 0.0);
        let mut none = [];
        assert_eq!(choose(&mut none, [0.0; 2], &bounds), [0.0; 2]);
    }

    #[test]
    fn ambient_light_is_that_of_lamps_in_the_box_and_of_all_that_is_outside() {
        let setting = |bounds: Bounds, sky: f64| LightSetting {
            sun: None,
            sky: DVec3::new(sky, 2.0 * sky, 0.0),
            disc_radius: 0.0,
            bounds,
        };
        let bounds = Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE };
        // Walls of 24 square metres get 12 watts of red light.
        let lit = |kind, red: f32| GpuLight { kind, color: [red, 0.0, 0.0], ..bytemuck::Zeroable::zeroed() };
        let lamp = lit(light_kind::POINT, 3.0 / PI as f32);
        let disc = lit(light_kind::DISC, 4.0);
        // The half space has half of the lamp's light where the cone is sharp, and a third of the half where it begins in the middle.
        let sharp = GpuLight { kind: light_kind::SPOT, ..lamp };
        let soft = GpuLight { cos_inner: 1.0, ..sharp };
        // 1 - 0.8 and a third of 0.8 - 0.5, of 2.
        let narrow = GpuLight { cone: 0.5, cos_inner: 0.8, ..sharp };
        let green = DVec3::new(0.0, 12.0 / PI, 0.0);
        for (lights, emitters, sky, by_lamps, from_outside) in [
            (&[lamp][..], DVec3::ZERO, 0.0, [0.5, 0.0, 0.0], [0.0; 3]),
            (&[sharp], DVec3::ZERO, 0.0, [0.25, 0.0, 0.0], [0.0; 3]),
            (&[soft], DVec3::ZERO, 0.0, [0.25 / 3.0, 0.0, 0.0], [0.0; 3]),
            (&[narrow], DVec3::ZERO, 0.0, [0.5 * 0.15, 0.0, 0.0], [0.0; 3]),
            (&[], green, 0.0, [0.0, 0.5, 0.0], [0.0; 3]),
            (&[], DVec3::ZERO, 2.0, [0.0; 3], [2.0, 4.0, 0.0]),
            (&[lamp, disc], green, 2.0, [0.5, 0.5, 0.0], [3.0, 4.0, 0.0]),
            (&[], DVec3::ZERO, 0.0, [0.0; 3], [0.0; 3]),
        ] {
            let found = ambient(lights, emitters, &setting(bounds, sky));
            let near =
                |found: [f32; 3], expected: [f32; 3]| Vec3::from(found).abs_diff_eq(expected.into(), 1e-6);
            assert!(near(found.lamp_irradiance, by_lamps), "{found:?}, not {by_lamps:?}");
            assert!(near(found.unoccluded_irradiance, from_outside), "{found:?}, not {from_outside:?}");
        }
        let point = setting(Bounds { min: Vec3::ONE, max: Vec3::ONE }, 0.0);
        assert_eq!(ambient(&[lamp], green, &point).lamp_irradiance, [0.0; 3], "no box");
    }
}
