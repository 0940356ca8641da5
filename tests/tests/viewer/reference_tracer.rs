//! A path tracer in double precision that knows nothing of the viewer's shaders: it draws all directions by the cosine, adds lamps
//! one by one, finds sun and sky by rays that leave the scene, and tests each triangle.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use lvk_gltf::{LightKind, Model};
use lvk_viewer::light::Environment;

use lvk_tests::random::Random;

/// Angles that the share of a rough reflector is computed for.
const ANGLES: usize = 128;
/// Surfaces of a path at most.
const DEPTH: u32 = 12;

/// A scene in double precision.
pub struct ReferenceTracer {
    triangles: Vec<([DVec3; 3], usize)>,
    surfaces: Vec<ReferenceSurface>,
    lamps: Vec<(DVec3, DVec3)>,
    sky: DVec3,
    sun: Option<(DVec3, f64, DVec3)>,
}

/// The metallic-roughness model of glTF in the layers that the viewer's shaders document.
struct ReferenceSurface {
    color: DVec3,
    metalness: f64,
    alpha: f64,
    f0: f64,
    emission: DVec3,
    /// Shares of all light, and of light by Schlick's weight, for cosines from 0 to 1.
    shares: Vec<[f64; 2]>,
}

impl ReferenceTracer {
    /// Takes the meshes, materials and point lights of a model whose nodes do not move them, under an even sky.
    pub fn new(model: &Model, environment: &Environment) -> Self {
        let pose = model.pose(None, 0.0);
        let mut triangles = Vec::new();
        for placement in model.placements(0, &pose) {
            for primitive in &model.meshes[placement.mesh].primitives {
                let at = |index: &u32| {
                    let place = primitive.positions.get(*index as usize).unwrap_or_default();
                    DVec3::from(place.map(f64::from))
                };
                let material = primitive.material.unwrap_or_default();
                triangles.extend(
                    primitive.indices.chunks(3).map(|corners| ([0, 1, 2].map(|i| at(&corners[i])), material)),
                );
            }
        }
        let surfaces = model.materials.iter().map(ReferenceSurface::new).collect();
        let lamps = model.nodes.iter().zip(&pose.world).filter_map(|(node, world)| {
            let light = &model.lights[node.light?];
            assert_eq!(light.kind, LightKind::Point);
            let intensity = DVec3::from(light.color.map(f64::from)) * f64::from(light.intensity);
            Some((world.w_axis.truncate().as_dvec3(), intensity))
        });
        let sun = environment.sun.map(|sun| {
            let cosine = f64::from(sun.radius).cos();
            let radiance = DVec3::from(sun.irradiance.map(f64::from)) / (PI * (1.0 - cosine * cosine));
            (DVec3::from(sun.direction.map(f64::from)), cosine, radiance)
        });
        let sky = DVec3::from(environment.sky.texels[0].map(f64::from));
        Self { triangles, surfaces, lamps: lamps.collect(), sky, sun }
    }

    /// One sample of the radiance that comes against a direction.
    pub fn sample(&self, mut origin: DVec3, mut direction: DVec3, random: &mut Random) -> DVec3 {
        let (mut light, mut left) = (DVec3::ZERO, DVec3::ONE);
        for _ in 0..DEPTH {
            let Some((distance, normal, material)) = self.nearest(origin, direction, f64::INFINITY) else {
                return light + left * self.outside(direction);
            };
            let surface = &self.surfaces[material];
            light += left * surface.emission;
            let normal = if normal.dot(direction) < 0.0 { normal } else { -normal };
            origin += distance * direction + 1e-7 * normal;
            let view = -direction;
            for (place, intensity) in &self.lamps {
                let way = *place - origin;
                let to_lamp = way.normalize();
                if to_lamp.dot(normal) > 0.0 && self.nearest(origin, to_lamp, way.length()).is_none() {
                    let scattered = surface.scattered(normal, view, to_lamp);
                    light += left * scattered * *intensity * to_lamp.dot(normal) / way.length_squared();
                }
            }
            direction = cosine_direction(normal, random);
            left *= surface.scattered(normal, view, direction) * PI;
        }
        light
    }

    fn outside(&self, direction: DVec3) -> DVec3 {
        let sun = self.sun.filter(|(middle, cosine, _)| middle.dot(direction) >= *cosine);
        self.sky + sun.map_or(DVec3::ZERO, |(_, _, radiance)| radiance)
    }

    /// Distance, normal and material of the nearest triangle (Moeller and Trumbore).
    fn nearest(&self, origin: DVec3, direction: DVec3, mut range: f64) -> Option<(f64, DVec3, usize)> {
        let mut found = None;
        for ([a, b, c], material) in &self.triangles {
            let (e1, e2) = (*b - *a, *c - *a);
            let p = direction.cross(e2);
            let determinant = e1.dot(p);
            let s = origin - *a;
            let (u, q) = (s.dot(p) / determinant, s.cross(e1));
            let (v, t) = (direction.dot(q) / determinant, e2.dot(q) / determinant);
            if determinant.abs() > 1e-14 && u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 1e-9 && t < range {
                range = t;
                found = Some((t, e1.cross(e2).normalize(), *material));
            }
        }
        found
    }
}

impl ReferenceSurface {
    fn new(material: &lvk_gltf::Material) -> Self {
        let [red, green, blue, _] = material.base_color.map(f64::from);
        let straight = (f64::from(material.ior) - 1.0) / (f64::from(material.ior) + 1.0);
        let alpha = f64::from(material.roughness).powi(2);
        let emission = DVec3::from(material.emissive.map(f64::from)) * f64::from(material.emissive_strength);
        Self {
            color: DVec3::new(red, green, blue),
            metalness: f64::from(material.metallic),
            alpha,
            f0: straight * straight,
            emission,
            shares: (0..=ANGLES)
                .map(|index| shares((index as f64 / ANGLES as f64).max(1e-3), alpha))
                .collect(),
        }
    }

    /// The light that goes to `view` from a direction, without the cosine.
    fn scattered(&self, normal: DVec3, view: DVec3, light: DVec3) -> DVec3 {
        let (n_v, n_l) = (normal.dot(view).max(1e-6), normal.dot(light).max(1e-6));
        let half = (view + light).normalize();
        let (n_h, v_h) = (normal.dot(half), view.dot(half));
        let lobe = distribution(n_h, self.alpha) * shadowing(n_v, n_l, self.alpha) / (4.0 * n_v * n_l);
        let weight = (1.0 - v_h).powi(5);
        let [all, grazing] = self.shares_at(n_v);
        let again = (1.0 - all) / all;
        let metal = (self.color + (1.0 - self.color) * weight) * (1.0 + self.color * again);
        let dielectric = (self.f0 + (1.0 - self.f0) * weight) * (1.0 + self.f0 * again);
        let reflected = (self.f0 * (all - grazing) + grazing) * (1.0 + self.f0 * again);
        let matte = (1.0 - reflected) * self.color / PI;
        self.metalness * metal * lobe + (1.0 - self.metalness) * (dielectric * lobe + matte)
    }

    fn shares_at(&self, cosine: f64) -> [f64; 2] {
        let place = cosine.clamp(0.0, 1.0) * ANGLES as f64;
        let low = (place as usize).min(ANGLES - 1);
        let part = place - low as f64;
        [0, 1].map(|i| self.shares[low][i] * (1.0 - part) + self.shares[low + 1][i] * part)
    }
}

/// Trowbridge and Reitz.
fn distribution(n_h: f64, alpha: f64) -> f64 {
    let a2 = alpha * alpha;
    a2 / (PI * (n_h * n_h * (a2 - 1.0) + 1.0).powi(2))
}

/// Smith's shadowing and masking of both directions, correlated by height.
fn shadowing(n_v: f64, n_l: f64, alpha: f64) -> f64 {
    let a2 = alpha * alpha;
    let part = |first: f64, second: f64| first * (a2 + (1.0 - a2) * second * second).sqrt();
    2.0 * n_v * n_l / (part(n_l, n_v) + part(n_v, n_l))
}

/// Sums over the hemisphere.
fn shares(cosine: f64, alpha: f64) -> [f64; 2] {
    let view = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let steps = 160;
    let mut sums = [0.0; 2];
    for i in 0..steps {
        for j in 0..steps {
            let (z, turn) =
                ((f64::from(i) + 0.5) / f64::from(steps), TAU * (f64::from(j) + 0.5) / f64::from(steps));
            let radius = (1.0 - z * z).sqrt();
            let light = DVec3::new(radius * turn.cos(), radius * turn.sin(), z);
            let half = (view + light).normalize();
            let lobe = distribution(half.z, alpha) * shadowing(cosine, z, alpha) / (4.0 * cosine);
            sums[0] += lobe;
            sums[1] += lobe * (1.0 - view.dot(half)).powi(5);
        }
    }
    sums.map(|sum| sum * TAU / f64::from(steps * steps))
}

fn cosine_direction(normal: DVec3, random: &mut Random) -> DVec3 {
    let tangent = normal.any_orthonormal_vector();
    let mut unit = || (random.bits() >> 11) as f64 / (1_u64 << 53) as f64;
    let (u, turn) = (unit(), TAU * unit());
    let local = DVec3::new(u.sqrt() * turn.cos(), u.sqrt() * turn.sin(), (1.0 - u).sqrt());
    local.x * tangent + local.y * normal.cross(tangent) + local.z * normal
}
