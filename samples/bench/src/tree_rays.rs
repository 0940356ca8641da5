//! Traces the same rays through trees of several builders, by one plain loop on one thread.
//!
//! The loop visits the children of a node in the order of their distance. It counts what the surface area heuristic estimates:
//! nodes and triangles that a ray tests.

use std::time::Instant;

use glam::Vec3;
use lvk::test_hooks::{CHILDREN, WideChild, WideLink, WideTree};

use crate::measure::{elapsed_ms, median_of};
use crate::mesh::Mesh;
use lvk_samples::scene::Camera;

/// A ray; the direction has any length, and distances count lengths of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ray {
    pub(super) origin: Vec3,
    pub(super) direction: Vec3,
}

/// Work of all rays.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct RayWork {
    pub(super) nodes: u64,
    pub(super) triangles: u64,
    /// Time of all rays in milliseconds.
    pub(super) time: f64,
}

/// Returns the rays of the pixels of a camera, row by row from the top.
pub(super) fn camera_rays(camera: &Camera, [width, height]: [u32; 2]) -> Vec<Ray> {
    let [right, up, forward] = camera.frame().map(Vec3::from_array);
    let half = (camera.vertical_fov_degrees.to_radians() / 2.0).tan();
    let aspect = width as f32 / height as f32;
    let ray = |number: u32| {
        let share = |at: u32, of: u32| (at as f32 + 0.5) / of as f32 * 2.0 - 1.0;
        let (x, y) = (share(number % width, width), share(number / width, height));
        let direction = forward + right * (x * half * aspect) - up * (y * half);
        Ray { origin: Vec3::from_array(camera.eye), direction }
    };
    (0..width * height).map(ray).collect()
}

/// Returns rays of all cameras of the mesh, `size` each.
pub(super) fn all_camera_rays(mesh: &Mesh, size: [u32; 2]) -> Vec<Ray> {
    mesh.cameras.iter().flat_map(|camera| camera_rays(camera, size)).collect()
}

/// Returns rays that go on from where `rays` end, in directions around the surface, for diffuse light.
pub(super) fn bounce_rays(tree: &WideTree, rays: &[Ray]) -> Vec<Ray> {
    let mut bounced = Vec::new();
    for (number, ray) in rays.iter().enumerate() {
        let Some(hit) = closest(tree, ray, &mut RayWork::default()) else { continue };
        bounced.push(bounce(number, ray, hit.distance, tree.triangles[hit.triangle]));
    }
    bounced
}

/// Returns the ray that goes on from where ray `number` meets a triangle.
pub(super) fn bounce(number: usize, ray: &Ray, distance: f32, [a, b, c]: [Vec3; 3]) -> Ray {
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let normal = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
    // Cosine distribution: a point of the unit sphere, moved by the normal. The points are a lattice.
    let share =
        |step: u64| ((number as u64 + 1).wrapping_mul(step) & u64::from(u32::MAX)) as f32 / 2_f32.powi(32);
    let (height, turn) = (share(0x9e37_79b9) * 2.0 - 1.0, share(0x85eb_ca77) * std::f32::consts::TAU);
    let around = (1.0 - height * height).max(0.0).sqrt();
    let on_sphere = Vec3::new(around * turn.cos(), around * turn.sin(), height);
    let at = ray.origin + ray.direction * distance;
    let offset = 1e-4 * (1.0 + at.abs().max_element());
    Ray { origin: at + normal * offset, direction: normal + on_sphere * 0.999 }
}

/// Traces all rays through each tree, `runs` times in turns. Returns for each tree the work, with the median of the times, and
/// the sum of the distances of the hits.
pub(super) fn trace_all(trees: &[(&str, WideTree)], rays: &[Ray], runs: u32) -> Vec<(RayWork, f64)> {
    let mut all = vec![Vec::new(); trees.len()];
    for _ in 0..runs {
        trees.iter().zip(&mut all).for_each(|((_, tree), traced)| traced.push(trace(tree, rays)));
    }
    let median = |traced: &Vec<(RayWork, f64)>| {
        let (work, sum) = traced.first().copied().unwrap_or_default();
        (RayWork { time: median_of(traced, |(work, _)| work.time), ..work }, sum)
    };
    all.iter().map(median).collect()
}

/// Traces all rays. Returns the work, and the sum of the distances of the hits.
fn trace(tree: &WideTree, rays: &[Ray]) -> (RayWork, f64) {
    let mut work = RayWork::default();
    let mut sum = 0.0;
    let start = Instant::now();
    for ray in rays {
        if let Some(hit) = closest(tree, ray, &mut work) {
            sum += f64::from(hit.distance * ray.direction.length());
        }
    }
    work.time = elapsed_ms(start);
    (work, sum)
}

struct Hit {
    distance: f32,
    /// In the order of the leaves.
    triangle: usize,
}

/// Finds the closest hit, and adds the work.
fn closest(tree: &WideTree, ray: &Ray, work: &mut RayWork) -> Option<Hit> {
    let inverse = ray.direction.recip();
    let mut found: Option<Hit> = None;
    let mut open: Vec<(f32, WideLink)> = vec![(0.0, WideLink::Node(0))];
    while let Some((entry, link)) = open.pop() {
        if found.as_ref().is_some_and(|hit| hit.distance < entry) {
            continue;
        }
        match link {
            WideLink::None => {}
            WideLink::Leaf { first, count } => {
                work.triangles += u64::from(count);
                for triangle in first as usize..(first + count) as usize {
                    let distance = distance_to(&tree.triangles[triangle], ray);
                    let least = found.as_ref().map_or(f32::INFINITY, |hit| hit.distance);
                    if distance.is_some_and(|distance| distance < least) {
                        found = distance.map(|distance| Hit { distance, triangle });
                    }
                }
            }
            WideLink::Node(number) => {
                work.nodes += 1;
                let least = found.as_ref().map_or(f32::INFINITY, |hit| hit.distance);
                let first = open.len();
                open.extend(entered(&tree.nodes[number as usize], ray, inverse, least));
                open[first..].sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
            }
        }
    }
    found
}

/// Returns the children whose bounds the ray enters before `least`, with the distance of the entry.
fn entered(
    children: &[WideChild; CHILDREN],
    ray: &Ray,
    inverse: Vec3,
    least: f32,
) -> impl Iterator<Item = (f32, WideLink)> {
    children.iter().filter_map(move |child| {
        let (low, high) = ((child.low - ray.origin) * inverse, (child.high - ray.origin) * inverse);
        let entry = low.min(high).max_element().max(0.0);
        // Rounding must not lose a box that is touched.
        let exit = low.max(high).min_element() * (1.0 + 4.0 * f32::EPSILON);
        (child.link != WideLink::None && entry <= exit && entry < least).then_some((entry, child.link))
    })
}

/// Möller and Trumbore (1997).
fn distance_to([a, b, c]: &[Vec3; 3], ray: &Ray) -> Option<f32> {
    let (ab, ac) = (*b - *a, *c - *a);
    let across = ray.direction.cross(ac);
    let inverse = 1.0 / ab.dot(across);
    let from = ray.origin - *a;
    let u = from.dot(across) * inverse;
    let along = from.cross(ab);
    let v = ray.direction.dot(along) * inverse;
    let distance = ac.dot(along) * inverse;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0).then_some(distance)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test")]
mod tests {
    use lvk::BuildFlags;
    use lvk::test_hooks::{build_by_obvhs, build_on_threads};

    use super::*;
    use crate::synthetic::spheres;

    /// Rays through the trees of two builders hit what the test of all triangles finds.
    #[test]
    fn rays_hit_what_the_test_of_all_triangles_finds() {
        let mesh = spheres(2_000);
        let mut trees = Vec::new();
        build_on_threads(&mesh.positions, &mesh.triangles, BuildFlags::FAST_TRACE, 1, 1, |build| {
            trees.push(build.tree().unwrap())
        });
        build_by_obvhs(&mesh.positions, &mesh.triangles, 1, 1, |build| trees.push(build.tree));
        let primary = all_camera_rays(&mesh, [16, 9]);
        let bounced = bounce_rays(&trees[0], &primary);
        assert!(bounced.len() > 100);
        for ray in primary.iter().chain(&bounced) {
            let all = trees[0].triangles.iter().filter_map(|triangle| distance_to(triangle, ray));
            let expected = all.fold(f32::INFINITY, f32::min);
            for tree in &trees {
                let mut work = RayWork::default();
                let found = closest(tree, ray, &mut work).map_or(f32::INFINITY, |hit| hit.distance);
                assert_eq!(found, expected);
                assert!(work.nodes >= 1 && work.triangles < 500, "{work:?}");
            }
        }
    }
}
