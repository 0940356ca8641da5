//! The share of light that a rough reflector sends on, by angle and roughness (`shaders/viewer/albedo.glsl`).

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

/// Entries along each axis (`kAlbedoSide` there).
pub(crate) const SIDE: usize = 64;
/// Directions for each entry, along each of two numbers.
const MICROFACETS: u32 = 24;
/// The smallest alpha of shaders (`kSmallestAlpha` in `shaders/viewer/ggx.glsl`).
pub(crate) const SMALLEST_ALPHA: f64 = 1e-3;

/// Computes the table: for each roughness (rows) and square root of the view's cosine (columns) the share of a reflector of
/// GGX microfacets that reflect all light, the part of it by Schlick's weight, and the share of sheen.
pub(crate) fn albedo_table() -> Vec<[f32; 3]> {
    let entry = |index: usize| {
        let part = |index: usize| index as f64 / (SIDE - 1) as f64;
        let (roughness, cosine) = (part(index / SIDE), part(index % SIDE).powi(2).max(1e-4));
        let [all, grazing] = ggx_albedo(cosine, (roughness * roughness).max(SMALLEST_ALPHA));
        [all as f32, grazing as f32, sheen_albedo(cosine, roughness) as f32]
    };
    (0..SIDE * SIDE).map(entry).collect()
}

/// The share of all light, and that of light weighted by `(1 - v.h)^5`.
fn ggx_albedo(cosine: f64, alpha: f64) -> [f64; 2] {
    let view = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let mut sums = [0.0; 2];
    for place in places() {
        // Few microfacets lean so far that they lose light. They have numbers near 1, where more places are taken.
        let rest = 1.0 - place.x;
        let weight = 3.0 * rest * rest;
        let normal = visible_normal(view, alpha, DVec2::new(1.0 - rest.powi(3), place.y));
        let facing = view.dot(normal);
        let light = 2.0 * facing * normal - view;
        if light.z > 0.0 {
            let (a, b) = (lambda(view, alpha), lambda(light, alpha));
            // The density of visible normals cancels all but the shadowing of the light.
            let share = weight * (1.0 + a) / (1.0 + a + b);
            sums[0] += share;
            sums[1] += share * (1.0 - facing).clamp(0.0, 1.0).powi(5);
        }
    }
    sums.map(|sum| sum / f64::from(MICROFACETS * MICROFACETS))
}

fn sheen_albedo(cosine: f64, roughness: f64) -> f64 {
    let view = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let inverse = 1.0 / (roughness * roughness).max(1e-3);
    let sum: f64 = places()
        .map(|u| {
            // Uniform over the hemisphere.
            let light = DVec3::new(
                (1.0 - u.x * u.x).sqrt() * (TAU * u.y).cos(),
                (1.0 - u.x * u.x).sqrt() * (TAU * u.y).sin(),
                u.x,
            );
            let half = (view + light).normalize_or(DVec3::Z);
            let distribution = (2.0 + inverse) * (1.0 - half.z * half.z).max(1e-7).powf(0.5 * inverse) / TAU;
            let visible = 1.0 / (4.0 * (light.z + view.z - light.z * view.z).max(1e-4));
            distribution * visible * light.z
        })
        .sum();
    sum * TAU / f64::from(MICROFACETS * MICROFACETS)
}

/// The middles of the cells of the unit square.
fn places() -> impl Iterator<Item = DVec2> {
    let middle = |index: u32| (f64::from(index) + 0.5) / f64::from(MICROFACETS);
    (0..MICROFACETS * MICROFACETS)
        .map(move |index| DVec2::new(middle(index / MICROFACETS), middle(index % MICROFACETS)))
}

/// Heitz, "Sampling the GGX Distribution of Visible Normals", 2018.
fn visible_normal(view: DVec3, alpha: f64, u: DVec2) -> DVec3 {
    let v = DVec3::new(alpha * view.x, alpha * view.y, view.z).normalize();
    let t1 = DVec3::new(-v.y, v.x, 0.0).normalize_or(DVec3::X);
    let t2 = v.cross(t1);
    let (sine, cosine) = (TAU * u.y).sin_cos();
    let (a, s) = (u.x.sqrt() * cosine, 0.5 * (1.0 + v.z));
    let b = (1.0 - s) * (1.0 - a * a).max(0.0).sqrt() + s * u.x.sqrt() * sine;
    let n = a * t1 + b * t2 + (1.0 - a * a - b * b).max(0.0).sqrt() * v;
    DVec3::new(alpha * n.x, alpha * n.y, n.z.max(1e-9)).normalize()
}

fn lambda(w: DVec3, alpha: f64) -> f64 {
    let tangent2 = (w.x * w.x + w.y * w.y) / (w.z * w.z).max(1e-300);
    0.5 * ((1.0 + alpha * alpha * tangent2).sqrt() - 1.0)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    /// The same share by a plain sum over the hemisphere, with the formula of the reflector written out.
    fn by_hemisphere(cosine: f64, alpha: f64) -> f64 {
        let view = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
        let steps = 400;
        let mut sum = 0.0;
        for i in 0..steps {
            for j in 0..steps {
                let (z, angle) =
                    ((f64::from(i) + 0.5) / f64::from(steps), TAU * (f64::from(j) + 0.5) / f64::from(steps));
                let radius = (1.0 - z * z).sqrt();
                let light = DVec3::new(radius * angle.cos(), radius * angle.sin(), z);
                let h = (view + light).normalize();
                let d = (h.z * h.z * (alpha * alpha - 1.0) + 1.0).powi(2);
                let distribution = alpha * alpha / (PI * d);
                let shadowing = 1.0 / (1.0 + lambda(view, alpha) + lambda(light, alpha));
                sum += distribution * shadowing / (4.0 * view.z);
            }
        }
        sum * TAU / f64::from(steps * steps)
    }

    #[test]
    fn shares_are_those_of_a_sum_over_the_hemisphere() {
        for (cosine, alpha) in [(0.9, 0.5), (0.5, 1.0), (0.2, 0.4), (0.7, 0.25), (0.9, 0.16), (0.98, 0.09)] {
            let (drawn, summed) = (ggx_albedo(cosine, alpha)[0], by_hemisphere(cosine, alpha));
            assert!((drawn - summed).abs() < 2e-3, "cosine {cosine}, alpha {alpha}: {drawn} and {summed}");
        }
    }

    #[test]
    fn smooth_reflectors_send_on_all_light_and_rough_ones_less() {
        let table = albedo_table();
        let at = |roughness: usize, cosine: usize| table[roughness * SIDE + cosine];
        assert!((at(0, 40)[0] - 1.0).abs() < 1e-3);
        assert!(at(SIDE - 1, 40)[0] < 0.75 && at(SIDE - 1, 40)[0] > 0.4);
        assert!(table.iter().all(|[all, grazing, sheen]| {
            (0.0..=1.0001).contains(all) && grazing <= all && sheen.is_finite() && *sheen >= 0.0
        }));
    }
}
