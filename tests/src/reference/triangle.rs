//! Crossing of a line with the plane of a triangle.

use lvk::glam::DVec3;

/// A line through the plane of a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Distance as a multiple of the direction.
    pub t: f64,
    /// Weights of the vertices. Their sum is 1, and all are positive inside of the triangle.
    pub weights: [f64; 3],
    /// Cosine between the direction and the normal `(b - a) x (c - a)`.
    pub cosine: f64,
}

impl Crossing {
    /// Returns the smallest weight: positive inside of the triangle.
    pub fn margin(&self) -> f64 {
        self.weights.iter().copied().fold(f64::INFINITY, f64::min)
    }
}

/// Crosses a line with the plane of a triangle. Returns `None` if they are parallel.
///
/// The triangle is sheared so that the line becomes an axis; what remains are three 2D edge tests, which two triangles
/// that share an edge compute from the same numbers (Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection").
pub fn cross(origin: DVec3, direction: DVec3, corners: &[DVec3; 3]) -> Option<Crossing> {
    let along = largest_axis(direction);
    let (right, up) = ((along + 1) % 3, (along + 2) % 3);
    let shear = (direction[right] / direction[along], direction[up] / direction[along]);
    let flat = corners.map(|corner| {
        let p = corner - origin;
        (p[right] - shear.0 * p[along], p[up] - shear.1 * p[along], p[along] / direction[along])
    });
    let edge = |a: usize, b: usize| flat[a].0 * flat[b].1 - flat[a].1 * flat[b].0;
    let areas = [edge(1, 2), edge(2, 0), edge(0, 1)];
    let whole: f64 = areas.iter().sum();
    if whole == 0.0 {
        return None;
    }
    let weights = areas.map(|area| area / whole);
    let t = weights[0] * flat[0].2 + weights[1] * flat[1].2 + weights[2] * flat[2].2;
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let cosine = normal.dot(direction) / (normal.length() * direction.length());
    Some(Crossing { t, weights, cosine })
}

fn largest_axis(v: DVec3) -> usize {
    let v = v.abs();
    if v.x >= v.y && v.x >= v.z {
        0
    } else if v.y >= v.z {
        1
    } else {
        2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn vector(random: &mut Random) -> DVec3 {
        (random.direction() * random.between(0.1, 5.0)).as_dvec3()
    }

    #[test]
    fn a_point_of_the_triangle_is_hit() {
        let mut random = Random::new(1);
        for _ in 0..2_000 {
            let corners = [vector(&mut random), vector(&mut random), vector(&mut random)];
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            let (origin, scale) = (vector(&mut random), f64::from(random.between(0.5, 2.0)));
            let (v, w) = (f64::from(random.between(-0.5, 1.5)), f64::from(random.between(-0.5, 1.5)));
            let point = corners[0] * (1.0 - v - w) + corners[1] * v + corners[2] * w;
            let direction = (point - origin) / scale;
            if normal.normalize().dot(direction.normalize()).abs() < 1e-3 {
                continue;
            }
            let found = cross(origin, direction, &corners).unwrap();
            assert!((found.t - scale).abs() < 1e-9);
            assert!((found.weights[1] - v).abs() < 1e-9 && (found.weights[2] - w).abs() < 1e-9);
            assert_eq!(found.cosine < 0.0, normal.dot(direction) < 0.0);
            assert_eq!(found.margin() > 0.0, v > 0.0 && w > 0.0 && v + w < 1.0);
        }
    }

    #[test]
    fn a_line_through_a_shared_edge_is_in_one_of_the_triangles() {
        let mut random = Random::new(2);
        for _ in 0..2_000 {
            let [a, b, left, right] = std::array::from_fn(|_| vector(&mut random));
            let along = f64::from(random.between(0.0, 1.0));
            let origin = vector(&mut random);
            let direction = a.lerp(b, along) - origin;
            let margins = [[a, b, left], [b, a, right]]
                .map(|corners| cross(origin, direction, &corners).map(|crossing| crossing.weights[2]));
            let [Some(left), Some(right)] = margins else { continue };
            assert!(left.abs() < 1e-9 && right.abs() < 1e-9);
        }
    }

    #[test]
    fn a_parallel_line_crosses_nothing() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        assert_eq!(cross(DVec3::Z, DVec3::X, &corners), None);
    }
}
