//! Triangles that refits move to the limits of f32 and back: hits of the other triangles stay the same.

use lvk::glam::Vec3;
use lvk::{BuildFlags, BuildMode, Context, RayQueryRequest, Result};
use lvk_tests::device_with;
use lvk_tests::gpu_built::scattered_triangles;
use lvk_tests::meshes::Mesh;
use lvk_tests::random::Random;
use lvk_tests::ray_scene::{GpuScene, Layout, RayScene, instances};
use lvk_tests::ray_tracer::{HitRecord, How, MISSED, Method, RayTracer};
use lvk_tests::rays::Ray;

const COUNT: usize = 600;

/// Trees of the CPU and of the GPU, and leaves of every kind that can be refitted.
const FLAGS: [BuildFlags; 4] = [
    BuildFlags::FAST_TRACE.union(BuildFlags::ALLOW_UPDATE),
    BuildFlags::FAST_BUILD.union(BuildFlags::ALLOW_UPDATE),
    BuildFlags::LOW_MEMORY.union(BuildFlags::ALLOW_UPDATE),
    BuildFlags::LOW_MEMORY.union(BuildFlags::FAST_BUILD).union(BuildFlags::ALLOW_UPDATE),
];

/// Shape that the triangles form.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shape {
    /// Each by itself.
    Triangles,
    /// Two share an edge, so that leaves may share vertices.
    Quads,
}

impl Shape {
    fn leaves(self, primitive: u32) -> bool {
        let index = if self == Self::Quads { primitive / 2 } else { primitive };
        index.is_multiple_of(3)
    }

    /// The corners of one of these three.
    fn move_vertices(self, [a, b, c]: [[f32; 3]; 3]) -> Vec<[f32; 3]> {
        let opposite = (Vec3::from(a) + Vec3::from(b) - Vec3::from(c)).to_array();
        if self == Self::Quads { vec![a, b, c, opposite] } else { vec![a, b, c] }
    }

    /// All vertices, with those that leave so far out on one side or the other.
    fn moved(self, reach: f32) -> Vec<[f32; 3]> {
        let mut triangles = scattered_triangles(COUNT, 1);
        for (number, triangle) in triangles.iter_mut().enumerate().step_by(3) {
            let way = if number % 2 == 0 { reach } else { -reach };
            triangle.iter_mut().for_each(|corner| corner[number / 6 % 3] += way);
        }
        triangles.into_iter().flat_map(|triangle| self.move_vertices(triangle)).collect()
    }

    fn scene(self) -> RayScene {
        let triangles = (0..COUNT as u32).flat_map(|number| match self {
            Self::Triangles => vec![[0, 1, 2].map(|corner| number * 3 + corner)],
            Self::Quads => [[0, 1, 2], [1, 0, 3]].map(|corners| corners.map(|it| number * 4 + it)).to_vec(),
        });
        let layout = if self == Self::Quads { Layout::Indexed32 } else { Layout::Unshared };
        RayScene::single(Mesh { positions: self.moved(0.0), triangles: triangles.collect() }, layout)
    }
}

/// One towards each of the scattered triangles.
fn rays() -> Vec<Ray> {
    let mut random = Random::new(131);
    let towards = |[a, b, c]: [[f32; 3]; 3]| {
        let middle = (Vec3::from(a) + Vec3::from(b) + Vec3::from(c)) / 3.0;
        let way = random.direction();
        Ray::new(middle - way * random.between(5.0, 150.0), way)
    };
    scattered_triangles(COUNT, 1).into_iter().map(towards).collect()
}

fn refit(ctx: &Context, gpu: &GpuScene, scene: &RayScene, vertices: &[[f32; 3]]) -> Result<()> {
    ctx.upload_buffer(*gpu.buffers[0].vertices, 0, bytemuck::cast_slice(vertices))?;
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.build_blas(&[*gpu.models[0]], BuildMode::Refit)?;
    cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), BuildMode::Rebuild)?;
    ctx.submit(cmd)?;
    Ok(())
}

/// Asserts that a ray that hit an unmoved triangle hits it still, bit for bit. A ray that hit another triangle may
/// hit one behind it.
fn check_near(what: &str, shape: Shape, before: &[HitRecord], after: &[HitRecord]) {
    for (number, (before, after)) in before.iter().zip(after).enumerate() {
        if shape.leaves(before.primitive) {
            let is_behind = !shape.leaves(after.primitive) && after.t > before.t;
            assert!(after.kind == MISSED || is_behind, "{what}, ray {number}: {after:?} after {before:?}");
        } else {
            assert_eq!(before, after, "{what}, ray {number}");
        }
    }
}

fn check_all(ctx: &Context, tracer: &RayTracer, shape: Shape, by: &str) -> Result<()> {
    let (scene, rays) = (shape.scene(), rays());
    for flags in FLAGS {
        let what = format!("{shape:?}, {flags:?}, {by}");
        let gpu = scene.upload_with(ctx, flags, BuildFlags::default(), 0)?;
        let before = tracer.trace(&gpu.tlas, &rays, How::default())?;
        assert!(before.iter().all(|record| record.kind != MISSED), "{what}: a ray misses its triangle");
        for reach in [1e16, 1e30, 3e38] {
            refit(ctx, &gpu, &scene, &shape.moved(reach))?;
            let after = tracer.trace(&gpu.tlas, &rays, How::default())?;
            check_near(&format!("{what}, {reach:e}"), shape, &before, &after);
        }
        refit(ctx, &gpu, &scene, &shape.moved(0.0))?;
        let again = tracer.trace(&gpu.tlas, &rays, How::default())?;
        assert_eq!(again, before, "{what}, back again");
    }
    Ok(())
}

#[test]
fn resting_triangles_are_hit_while_neighbours_move_far_out() -> Result<()> {
    let Some(ctx) = device_with(|desc| desc.ray_query = RayQueryRequest::Software) else { return Ok(()) };
    let (plain, opaque) = (RayTracer::new(&ctx, Method::Query)?, RayTracer::for_opaque_triangles(&ctx)?);
    for shape in [Shape::Triangles, Shape::Quads] {
        check_all(&ctx, &plain, shape, "by query")?;
        check_all(&ctx, &opaque, shape, "all taken for opaque")?;
    }
    Ok(())
}

/// Eight triangles side by side, as large as `size`, and rays down on their middles from as far.
fn triangles_in_a_row(size: f32) -> (RayScene, Vec<Ray>) {
    let corner = |number: u32, x: f32, y: f32| [(number as f32 * 1.5 + x) * size, y * size, 0.25 * size];
    let positions = (0..8).flat_map(|at| [corner(at, 0.0, 0.0), corner(at, 1.0, 0.0), corner(at, 0.0, 1.0)]);
    let triangles = (0..8).map(|at| [0, 1, 2].map(|of| at * 3 + of));
    let mesh = Mesh { positions: positions.collect(), triangles: triangles.collect() };
    let ray = |at: u32| {
        let from = Vec3::new((at as f32 * 1.5 + 0.25) * size, 0.25 * size, 1.25 * size);
        Ray { t_max: 1e30, ..Ray::new(from, -Vec3::Z) }
    };
    (RayScene::single(mesh, Layout::Unshared), (0..8).map(ray).collect())
}

/// Areas by lengths are beyond what floats hold long before either is.
#[test]
fn hits_are_as_far_as_triangles_are_large() -> Result<()> {
    let Some(ctx) = device_with(|desc| desc.ray_query = RayQueryRequest::Software) else { return Ok(()) };
    let tracers = [RayTracer::new(&ctx, Method::Query)?, RayTracer::for_opaque_triangles(&ctx)?];
    for size in [1e-15, 1e-12, 1e-6, 1.0, 1e6, 1e12, 1e13, 5e13] {
        let (scene, rays) = triangles_in_a_row(size);
        for flags in FLAGS {
            let gpu = scene.upload_with(&ctx, flags, BuildFlags::default(), 0)?;
            for tracer in &tracers {
                for (number, hit) in (0..).zip(tracer.trace(&gpu.tlas, &rays, How::default())?) {
                    let is_near = (hit.t / size - 1.0).abs() < 1e-5;
                    assert!(
                        hit.kind != MISSED && hit.primitive == number && is_near,
                        "{size}, {flags:?}: {hit:?}"
                    );
                }
            }
        }
    }
    Ok(())
}
