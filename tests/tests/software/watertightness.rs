//! Watertightness: no ray passes through the edges of closed meshes in the library's own traversal.

use std::collections::HashMap;

use lvk::glam::{Affine3A, Quat, Vec3};
use lvk::{BuildFlags, Context, GeometryFlags, RayQueryRequest, Result};
use lvk_tests::meshes::Mesh;
use lvk_tests::random::Random;
use lvk_tests::ray_scene::{BUILD_FLAGS, GpuScene, Layout, Part, Placed, RayScene};
use lvk_tests::ray_tracer::{How, MISSED, Method, RayTracer};
use lvk_tests::rays::Ray;
use lvk_tests::{TestDevice, device_with};

fn software() -> Option<TestDevice> {
    device_with(|desc| desc.ray_query = RayQueryRequest::Software)
}

/// A closed mesh around the origin whose triangles share their vertices to the bit.
fn closed_ball(rounds: u32) -> Mesh {
    let t = (1.0 + 5.0_f32.sqrt()) / 2.0;
    let corners = [(-1.0, t), (1.0, t), (-1.0, -t), (1.0, -t)];
    let mut positions: Vec<Vec3> = Vec::new();
    positions.extend(corners.map(|(a, b)| Vec3::new(a, b, 0.0)));
    positions.extend(corners.map(|(a, b)| Vec3::new(0.0, a, b)));
    positions.extend(corners.map(|(a, b)| Vec3::new(b, 0.0, a)));
    positions.iter_mut().for_each(|position| *position = position.normalize());
    let mut triangles = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..rounds {
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                positions.push((positions[a as usize] + positions[b as usize]).normalize() * 0.999);
                positions.len() as u32 - 1
            })
        };
        let mut finer = Vec::with_capacity(triangles.len() * 4);
        for [a, b, c] in triangles {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    Mesh { positions: positions.iter().map(|position| position.to_array()).collect(), triangles }
}

/// Rays from inside of one of the [`closed_meshes`] at its corners, along its edges' points, and anywhere.
fn rays_at_seams(mesh: &Mesh, seed: u64, count: usize) -> Vec<Ray> {
    let mut random = Random::new(seed);
    let corner = |index: u32| Vec3::from(mesh.positions[index as usize]);
    let mut ray = |number: usize| {
        let [a, b, c] =
            mesh.triangles[(random.between(0.0, 1.0) * 0.999 * mesh.triangles.len() as f32) as usize];
        let share = random.between(0.0, 1.0);
        let at = match number % 3 {
            0 => corner(a),
            1 => corner(a).lerp(corner(b), share),
            _ => corner(a).lerp(corner(b), share).lerp(corner(c), random.between(0.0, 1.0)),
        };
        let [inside, ..] = mesh.triangles[number % mesh.triangles.len()];
        let from = match number % 5 {
            0 => Vec3::ZERO,
            _ => corner(inside) * random.between(0.0, 0.8),
        };
        Ray::new(from, at - from)
    };
    (0..count).map(&mut ray).collect()
}

/// Closed meshes whose surface every ray from the origin meets once: an even one, one of thin triangles that all meet at
/// two poles, one of very different triangles, and one a thousand times as wide as it is thick.
fn closed_meshes() -> [(&'static str, Mesh); 4] {
    let spike = |number, at| if number % 5 == 0 { at * 4.0 } else { at };
    [
        ("ball", closed_ball(4)),
        ("spindle", spindle(600)),
        ("spikes", moved(closed_ball(3), spike)),
        ("flake", moved(closed_ball(4), |_, at| at * Vec3::new(1.0, 1e-3, 1.0))),
    ]
}

/// Triangles around an axis, as thin as there are many.
fn spindle(sides: u32) -> Mesh {
    let angle = |side: u32| side as f32 / sides as f32 * std::f32::consts::TAU;
    let rim = (0..sides).map(|side| [angle(side).cos(), angle(side).sin(), 0.0]);
    let next = |side: u32| (side + 1) % sides;
    let triangles = (0..sides).flat_map(|side| [[side, next(side), sides], [next(side), side, sides + 1]]);
    Mesh {
        triangles: triangles.collect(),
        positions: rim.chain([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]).collect(),
    }
}

/// The mesh with every corner elsewhere, so that it stays closed.
fn moved(mut mesh: Mesh, place: impl Fn(usize, Vec3) -> Vec3) -> Mesh {
    for (number, position) in mesh.positions.iter_mut().enumerate() {
        *position = place(number, Vec3::from(*position)).to_array();
    }
    mesh
}

/// Creates tracers of a module with candidates, and of one with opaque triangles alone, whose traversals differ.
fn tracers(ctx: &Context) -> Result<[RayTracer; 2]> {
    Ok([RayTracer::new(ctx, Method::Query)?, RayTracer::for_opaque_triangles(ctx)?])
}

/// A mesh at a place, and one turned and stretched.
fn transforms() -> [Affine3A; 2] {
    let odd = Affine3A::from_scale_rotation_translation(
        Vec3::new(3.0, 0.5, -1.25),
        Quat::from_axis_angle(Vec3::new(0.6, 0.0, 0.8), 1.1),
        Vec3::new(7.0, -3.0, 11.0),
    );
    [Affine3A::IDENTITY, odd]
}

/// The mesh alone, of opaque triangles.
fn alone(mesh: Mesh, transform: Affine3A) -> RayScene {
    let part = Part::new(mesh, Layout::Indexed32);
    RayScene { models: vec![vec![part]], placed: vec![Placed::new(0, transform)] }
}

/// The mesh of candidates, each triangle twice: a ray that passes by every second one is interrupted at the seams.
fn of_candidates(mesh: Mesh, transform: Affine3A) -> RayScene {
    let triangles = mesh.triangles.iter().flat_map(|triangle| [*triangle; 2]).collect();
    let mut scene = alone(Mesh { triangles, ..mesh }, transform);
    scene.models[0][0].flags = GeometryFlags::empty();
    scene
}

/// The mesh within another instance that [`SEEN`] leaves out.
fn overlapped(mesh: Mesh, transform: Affine3A) -> RayScene {
    let mut scene = alone(mesh, transform);
    scene.placed[0].mask = SEEN;
    let beside = transform * Affine3A::from_translation(Vec3::X * 0.1);
    scene.placed.push(Placed { mask: !SEEN, ..Placed::new(0, beside) });
    scene
}

/// The mask of rays.
const SEEN: u8 = 1;

/// Returns the number of `count` rays from inside of a closed mesh that leave it without a hit, by each of the
/// tracers, for the mesh as it is and rotated and stretched. The last `absent` triangles are left out, but rays go
/// there too.
fn leaks<const TRACERS: usize>(
    tracers: &[RayTracer; TRACERS],
    show: fn(Mesh, Affine3A) -> RayScene,
    mesh: &Mesh,
    absent: usize,
    count: usize,
    flags: BuildFlags,
) -> Result<[usize; TRACERS]> {
    let mut built = mesh.clone();
    built.triangles.truncate(mesh.triangles.len() - absent);
    let mut leaks = [0; TRACERS];
    for transform in transforms() {
        let scene = show(built.clone(), transform);
        let gpu: GpuScene = scene.upload_with(tracers[0].context(), flags, BuildFlags::default(), 0)?;
        let moved = |ray: Ray| Ray {
            origin: transform.transform_point3(ray.origin.into()).into(),
            direction: transform.transform_vector3(ray.direction.into()).into(),
            ..ray
        };
        let mut left = count / 2;
        for part in 0.. {
            if left == 0 {
                break;
            }
            let rays = rays_at_seams(mesh, part, CHUNK.min(left));
            left -= rays.len();
            let rays: Vec<_> = rays.into_iter().map(moved).collect();
            for (leaks, tracer) in leaks.iter_mut().zip(tracers) {
                let records = tracer.trace(&gpu.tlas, &rays, How { mask: SEEN, ..How::default() })?;
                *leaks += records.iter().filter(|record| record.kind == MISSED).count();
            }
        }
    }
    Ok(leaks)
}

const CHUNK: usize = 1 << 20;

/// Traces `count` rays in each of the meshes, built with each of the flags.
fn check_seams(count: usize) -> Result<()> {
    let Some(ctx) = software() else { return Ok(()) };
    let tracers = tracers(&ctx)?;
    for (name, mesh) in closed_meshes() {
        for flags in BUILD_FLAGS {
            assert_eq!(leaks(&tracers, alone, &mesh, 0, count, flags)?, [0, 0], "{name}, {flags:?}");
        }
    }
    Ok(())
}

#[test]
fn no_ray_slips_through_a_seam() -> Result<()> {
    check_seams(30_000)
}

#[test]
fn no_ray_that_is_interrupted_at_a_seam_slips_through() -> Result<()> {
    let Some(ctx) = software() else { return Ok(()) };
    let tracers = [RayTracer::with_even_primitives(&ctx, Method::Query)?];
    for (name, mesh) in closed_meshes() {
        for flags in BUILD_FLAGS {
            assert_eq!(leaks(&tracers, of_candidates, &mesh, 0, 10_000, flags)?, [0], "{name}, {flags:?}");
        }
    }
    Ok(())
}

/// A BLAS that the CPU builds without refits is opened by re-braiding where it overlaps others and has empty space: a
/// ball stretched along a diagonal.
#[test]
fn no_ray_slips_through_a_seam_between_parts() -> Result<()> {
    let Some(ctx) = software() else { return Ok(()) };
    let tracers = tracers(&ctx)?;
    let count_records = records_counter(&ctx)?;
    let diagonal = Vec3::ONE.normalize();
    let needle = moved(closed_ball(4), |_, at| at + diagonal * at.dot(diagonal) * 20.0);
    for flags in [BuildFlags::FAST_TRACE, BuildFlags::LOW_MEMORY] {
        for transform in transforms() {
            let scene = overlapped(needle.clone(), transform);
            let gpu = scene.upload_with(&ctx, flags, BuildFlags::default(), 0)?;
            let ray = Ray::new(Vec3::ZERO, Vec3::X);
            let records = count_records.trace(&gpu.tlas, &[ray], How::default())?[0].primitive;
            assert!(records > 4, "{records} records of two instances");
        }
        assert_eq!(leaks(&tracers, overlapped, &needle, 0, 30_000, flags)?, [0, 0], "{flags:?}");
    }
    Ok(())
}

/// Tells how many records a TLAS has, each of an instance or a part of one, as the number of a primitive.
fn records_counter(ctx: &Context) -> Result<RayTracer> {
    const TEXT: &str = r#"
        #include <lvk/ray_query.glsl>
        #include "ray_records.glsl"
        layout(local_size_x = 64) in;
        void main() {
            HitRecord record = kNoHit;
            record.primitive = LvkSoftBlocks(kLvkTlasTable.entry[tlas].software).at[0].w;
            if (gl_GlobalInvocationID.x < count) {
                hits.at[gl_GlobalInvocationID.x] = record;
            }
        }"#;
    RayTracer::from_query_text(ctx, TEXT, &[])
}

/// A third of the rays goes to insides of triangles, and a third to edges, where rounding decides on which side they leave.
#[test]
fn rays_leave_through_an_absent_triangle() -> Result<()> {
    const COUNT: usize = 12_000;
    let Some(ctx) = software() else { return Ok(()) };
    let tracers = tracers(&ctx)?;
    let ball = closed_ball(1);
    let through = COUNT / 3 / ball.triangles.len();
    for flags in BUILD_FLAGS {
        for leaks in leaks(&tracers, alone, &ball, 1, COUNT, flags)? {
            assert!((through / 2..through * 3).contains(&leaks), "{leaks} leaks with {flags:?}");
        }
    }
    Ok(())
}

/// A lane of its own in `CONTRIBUTING.md`.
#[test]
#[ignore = "takes minutes on a CPU"]
fn none_of_ten_million_rays_slips_through_a_seam() -> Result<()> {
    check_seams(10_000_000)
}
