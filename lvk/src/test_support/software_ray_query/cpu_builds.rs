//! Builds on the CPU with a given number of threads, and the cost of their trees.

#![allow(missing_docs, reason = "only tests and benchmarks see it")]

use std::time::{Duration, Instant};

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::triangle::Triangle;

use super::wide_tree::WideTree;
use crate::accel::flags::BuildFlags;
use crate::accel::geometry::GeometryFlags;
use crate::accel::primitive_bounds::{GeometryBytes, IndexBytes, TriangleBytes, VertexBytes};
use crate::format::VertexFormat;
use crate::software_ray_query::bvh::build_threads::on_new_threads;
use crate::software_ray_query::bvh::encode_blas::encode_blas_timed;
use crate::software_ray_query::bvh::phase_times::PhaseTimes;
use crate::software_ray_query::bvh::primitives::Mesh;
use crate::software_ray_query::bvh::settings::BvhSettings;

/// A build of one mesh on the CPU.
#[derive(Debug, Clone, PartialEq)]
pub struct CpuBuild {
    /// The phases in order, each with its time.
    pub phases: Vec<(&'static str, Duration)>,
    /// Time of the whole build.
    pub total: Duration,
    /// The bytes of the BLAS.
    pub bytes: Vec<u8>,
}

impl CpuBuild {
    /// Returns the tree. `None` for one without wide nodes.
    #[must_use]
    pub fn tree(&self) -> Option<WideTree> {
        WideTree::of_blas(&self.bytes)
    }
}

/// Builds a BLAS of triangles with vertex indices by these flags on `threads` threads, `runs` times. `done` sees each build.
pub fn build_on_threads(
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
    flags: BuildFlags,
    threads: usize,
    runs: u32,
    mut done: impl FnMut(CpuBuild) + Send,
) {
    on_new_threads(threads, || (0..runs).for_each(|_| done(build(positions, triangles, flags))));
}

/// A build of one mesh by a builder of the crate `obvhs`.
#[derive(Debug, Clone, PartialEq)]
pub struct ObvhsBuild {
    /// Time of the whole build.
    pub total: Duration,
    /// The tree.
    pub tree: WideTree,
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
            let of_leaf = |index: &u32| {
                let triangle = triangles[*index as usize];
                [triangle.v0, triangle.v1, triangle.v2].map(Vec3::from)
            };
            let leaves = bvh.primitive_indices.iter().map(of_leaf);
            let tree = WideTree::of_compressed(bvh.nodes.iter().copied(), leaves);
            done(ObvhsBuild { total, tree });
        }
    });
}

fn build(positions: &[[f32; 3]], triangles: &[[u32; 3]], flags: BuildFlags) -> CpuBuild {
    let settings = BvhSettings::from_flags(flags);
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
    CpuBuild { phases: times.into_phases(), total, bytes: blob.bytes }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test")]
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
                build_on_threads(&positions, &triangles, BuildFlags::FAST_TRACE, threads, 2, |build| {
                    built.push(build)
                });
            }
            let [first, others @ ..] = &built[..] else { unreachable!("eight builds") };
            let cost = first.tree().unwrap().sah_cost();
            assert!(cost > 1.0 && cost < 100.0, "{cost}");
            assert!(others.iter().all(|other| other.bytes == first.bytes), "{count}");
            build_by_obvhs(&positions, &triangles, 2, 1, |other| {
                let ratio = cost / other.tree.sah_cost();
                assert!(ratio > 0.5 && ratio < 1.2, "{count}: {ratio}");
            });
            assert!(first.phases.iter().map(|(_, time)| *time).sum::<Duration>() <= first.total);
        }
    }
}
