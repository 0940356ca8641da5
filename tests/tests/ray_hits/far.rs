//! Triangles that refits move as far out as numbers go, and back: those that stay are hit as before.

use lvk::glam::Vec3;
use lvk::{BuildFlags, BuildMode, Context, RayQueryRequest, Result};
use lvk_tests::device_with;
use lvk_tests::gpu_built::scattered;
use lvk_tests::meshes::Mesh;
use lvk_tests::random::Random;
use lvk_tests::ray_scene::{GpuScene, Layout, RayScene, instances};
use lvk_tests::ray_tracer::{HitRecord, How, MISSED, Method, RayTracer};
use lvk_tests::rays::Ray;

const COUNT: usize = 600;

/// Trees of the CPU and of the GPU, and leaves of every kind that can be refitted.
const FLAGS: [BuildFlags; 3] = [
    BuildFlags::FAST_TRACE.union(BuildFlags::ALLOW_UPDATE),
    BuildFlags::FAST_BUILD.union(BuildFlags::ALLOW_UPDATE),
    BuildFlags::LOW_MEMORY.union(BuildFlags::ALLOW_UPDATE),
];

fn leaves(primitive: usize) -> bool {
    primitive.is_multiple_of(3)
}

/// The triangles, with those that leave so far out on one side or the other.
fn moved(reach: f32) -> Vec<[[f32; 3]; 3]> {
    let mut triangles = scattered(COUNT, 1);
    for (number, triangle) in triangles.iter_mut().enumerate().filter(|(number, _)| leaves(*number)) {
        let way = if number % 2 == 0 { reach } else { -reach };
        triangle.iter_mut().for_each(|corner| corner[number / 6 % 3] += way);
    }
    triangles
}

/// One towards each triangle.
fn rays() -> Vec<Ray> {
    let mut random = Random::new(131);
    let towards = |[a, b, c]: [[f32; 3]; 3]| {
        let middle = (Vec3::from(a) + Vec3::from(b) + Vec3::from(c)) / 3.0;
        let way = random.direction();
        Ray::new(middle - way * random.between(5.0, 150.0), way)
    };
    scattered(COUNT, 1).into_iter().map(towards).collect()
}

fn refit(ctx: &Context, gpu: &GpuScene, scene: &RayScene, reach: f32) -> Result<()> {
    ctx.upload_buffer(*gpu.buffers[0].vertices, 0, bytemuck::cast_slice(&moved(reach)))?;
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.build_blas(&[*gpu.models[0]], BuildMode::Refit)?;
    cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), BuildMode::Rebuild)?;
    ctx.submit(cmd)?;
    Ok(())
}

/// What hit a triangle that stays hits it still, to the bit; what hit another may hit one behind it.
fn check_near(what: &str, before: &[HitRecord], after: &[HitRecord]) {
    for (number, (before, after)) in before.iter().zip(after).enumerate() {
        if leaves(before.primitive as usize) {
            let is_behind = !leaves(after.primitive as usize) && after.t > before.t;
            assert!(after.kind == MISSED || is_behind, "{what}, ray {number}: {after:?} after {before:?}");
        } else {
            assert_eq!(before, after, "{what}, ray {number}");
        }
    }
}

fn check_all(ctx: &Context, tracer: &RayTracer, by: &str) -> Result<()> {
    let positions = moved(0.0).concat();
    let triangles = (0..COUNT as u32).map(|number| [0, 1, 2].map(|corner| number * 3 + corner)).collect();
    let scene = RayScene::single(Mesh { positions, triangles }, Layout::Unshared);
    let rays = rays();
    for flags in FLAGS {
        let gpu = scene.upload_with(ctx, flags, BuildFlags::default(), 0)?;
        let before = tracer.trace(&gpu.tlas, &rays, How::default())?;
        assert!(
            before.iter().all(|record| record.kind != MISSED),
            "{flags:?}, {by}: a ray misses its triangle"
        );
        for reach in [1e16, 1e30, 3e38] {
            refit(ctx, &gpu, &scene, reach)?;
            let after = tracer.trace(&gpu.tlas, &rays, How::default())?;
            check_near(&format!("{flags:?}, {reach:e}, {by}"), &before, &after);
        }
        refit(ctx, &gpu, &scene, 0.0)?;
        assert_eq!(tracer.trace(&gpu.tlas, &rays, How::default())?, before, "{flags:?}, back again, {by}");
    }
    Ok(())
}

#[test]
fn what_stays_is_hit_while_neighbours_move_far_out() -> Result<()> {
    let Some(ctx) = device_with(|desc| desc.ray_query = RayQueryRequest::Software) else { return Ok(()) };
    check_all(&ctx, &RayTracer::new(&ctx, Method::Query)?, "by query")?;
    check_all(&ctx, &RayTracer::for_opaque_triangles(&ctx)?, "all taken for opaque")
}
