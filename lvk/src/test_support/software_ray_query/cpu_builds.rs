//! Builds on the CPU with a given number of threads, and the cost of their trees.

#![allow(missing_docs, reason = "only tests and benchmarks see it")]

use std::time::{Duration, Instant};

use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::cwbvh::node::CwBvhNode;
use obvhs::triangle::Triangle;

use crate::accel::geometry::GeometryFlags;
use crate::accel::primitive_bounds::{GeometryBytes, IndexBytes, TriangleBytes, VertexBytes};
use crate::format::VertexFormat;
use crate::software_ray_query::bvh::build_threads::on_new_threads;
use crate::software_ray_query::bvh::encode_blas::{BlasBlob, encode_blas_timed};
use crate::software_ray_query::bvh::phase_times::PhaseTimes;
use crate::software_ray_query::bvh::primitives::Mesh;
use crate::software_ray_query::bvh::settings::BvhSettings;
use crate::software_ray_query::layout::{BLOCK_BYTES, FORMAT_BVH8};

/// A build of one mesh on the CPU.
#[derive(Debug, Clone, PartialEq)]
pub struct CpuBuild {
    /// The phases in order, each with its time.
    pub phases: Vec<(&'static str, Duration)>,
    /// Time of the whole build.
    pub total: Duration,
    /// The bytes of the BLAS.
    pub bytes: Vec<u8>,
    /// Cost of the tree by the surface area heuristic: tests of nodes by a random ray that hits the bounds, plus 0.3 for
    /// each test of a primitive. `None` for a tree without wide nodes.
    pub sah_cost: Option<f64>,
}

/// Builds a BLAS of triangles with vertex indices on `threads` threads, `runs` times. `done` sees each build.
pub fn build_on_threads(
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
    threads: usize,
    runs: u32,
    mut done: impl FnMut(CpuBuild) + Send,
) {
    on_new_threads(threads, || (0..runs).for_each(|_| done(build(positions, triangles))));
}

/// A build of one mesh by a builder of the crate `obvhs`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObvhsBuild {
    /// Time of the whole build.
    pub total: Duration,
    /// As [`CpuBuild::sah_cost`].
    pub sah_cost: f64,
}

/// Builds a BVH of eight compressed children by `obvhs` on `threads` threads, `runs` times, with its preset
/// `slow_build`, which reinserts nodes as the library does. `done` sees each build.
///
/// Numbers of vertices beyond `positions` take the last of them.
pub fn build_by_obvhs(
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
    threads: usize,
    runs: u32,
    mut done: impl FnMut(ObvhsBuild) + Send,
) {
    let corner = |index: u32| {
        let nearest = positions.get(index as usize).or(positions.last()).copied();
        Vec3A::from_array(nearest.unwrap_or_default())
    };
    let triangles: Vec<Triangle> = triangles
        .iter()
        .map(|[a, b, c]| Triangle { v0: corner(*a), v1: corner(*b), v2: corner(*c) })
        .collect();
    let params = BvhBuildParams { pre_split: false, ..BvhBuildParams::slow_build() };
    on_new_threads(threads, || {
        for _ in 0..runs {
            let mut total = Duration::ZERO;
            let bvh = build_cwbvh_from_tris(&triangles, params, &mut total);
            let sah_cost = cost_of(bvh.nodes.into_iter(), bvh.total_aabb.half_area().into());
            done(ObvhsBuild { total, sah_cost });
        }
    });
}

fn build(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> CpuBuild {
    let settings = BvhSettings { low_memory: false, refit: false };
    let bytes = bytemuck::cast_slice(positions);
    let count = positions.len() as u32;
    let vertices = VertexBytes { bytes, stride: 0, format: VertexFormat::F32x3, count };
    let indices = IndexBytes::U32(bytemuck::cast_slice(triangles));
    let all = TriangleBytes { vertices, indices, count: triangles.len() as u32, transform: None };
    let geometry = (GeometryBytes::Triangles(all), GeometryFlags::OPAQUE);
    let (mut times, start) = (PhaseTimes::on(), Instant::now());
    let mesh = times.run("triangles", || Mesh::new(&[geometry], settings));
    let blob = encode_blas_timed(&mesh, settings, &mut times);
    times.run("release of the triangles", || drop(mesh));
    let total = start.elapsed();
    CpuBuild { phases: times.into_phases(), total, sah_cost: sah_cost(&blob), bytes: blob.bytes }
}

fn sah_cost(blob: &BlasBlob) -> Option<f64> {
    let header = blob.header();
    if header.format != FORMAT_BVH8 || header.node_count == 0 {
        return None;
    }
    let first = header.nodes as usize * BLOCK_BYTES;
    let nodes =
        blob.bytes.get(first..)?.chunks_exact(size_of::<CwBvhNode>()).take(header.node_count as usize);
    Some(cost_of(nodes.map(bytemuck::pod_read_unaligned::<CwBvhNode>), blob.bounds.half_area().into()))
}

fn cost_of(nodes: impl Iterator<Item = CwBvhNode>, half_area: f64) -> f64 {
    const PRIMITIVE_COST: f64 = 0.3;
    let mut sum = 0.0;
    for node in nodes {
        for child in (0..8).filter(|child| node.child_meta[*child] != 0) {
            let primitives = f64::from((node.child_meta[child] >> 5).count_ones());
            let is_node = node.imask >> child & 1 == 1;
            sum += child_half_area(&node, child) * if is_node { 1.0 } else { PRIMITIVE_COST * primitives };
        }
    }
    1.0 + sum / half_area
}

fn child_half_area(node: &CwBvhNode, child: usize) -> f64 {
    let low = [node.child_min_x[child], node.child_min_y[child], node.child_min_z[child]];
    let high = [node.child_max_x[child], node.child_max_y[child], node.child_max_z[child]];
    let step = |axis: usize| f64::from(f32::from_bits(u32::from(node.e[axis]) << 23));
    let [x, y, z] = [0, 1, 2].map(|axis| f64::from(high[axis] - low[axis]) * step(axis));
    x * y + y * z + z * x
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles in clusters of very different density.
    fn scattered(count: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let share = |number: u32| number.wrapping_mul(0x9e37_79b9) as f32 / u32::MAX as f32;
        let corner = |number: u32| {
            let (triangle, cluster) = (number / 3, number / 3 % 7);
            let size = 0.5_f32.powi(cluster as i32 * 2);
            let at = |axis: u32| share(triangle * 3 + axis) * size + share(number * 5 + axis) * size * 0.02;
            [at(0) + cluster as f32, at(1), at(2)]
        };
        let triangles = (0..count).map(|triangle| [0, 1, 2].map(|step| triangle * 3 + step)).collect();
        ((0..3 * count).map(corner).collect(), triangles)
    }

    #[test]
    fn a_blas_is_the_same_for_any_number_of_threads() {
        for count in [5, 300, 30_000] {
            let (positions, triangles) = scattered(count);
            let mut built = Vec::new();
            for threads in [1, 2, 3, 7] {
                build_on_threads(&positions, &triangles, threads, 2, |build| built.push(build));
            }
            let [first, others @ ..] = &built[..] else { unreachable!("eight builds") };
            assert!(first.sah_cost.is_some_and(|cost| cost > 1.0 && cost < 100.0), "{:?}", first.sah_cost);
            assert!(others.iter().all(|other| other.bytes == first.bytes), "{count}");
            build_by_obvhs(&positions, &triangles, 2, 1, |other| {
                let ratio = first.sah_cost.unwrap_or(0.0) / other.sah_cost;
                assert!(ratio > 0.5 && ratio < 1.2, "{count}: {ratio}");
            });
            assert!(first.phases.iter().map(|(_, time)| *time).sum::<Duration>() <= first.total);
        }
    }
}
