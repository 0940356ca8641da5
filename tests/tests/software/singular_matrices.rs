//! Instances with singular matrices: no ray hits them, for every builder; instances with very small and very large
//! scales are hit.

use lvk::glam::{Affine3A, Mat3, Vec3};
use lvk::{BuildFlags, BuildMode, Context, DeviceInstances, RayQueryRequest, Result, transform_rows};
use lvk_tests::compute::words_buffer;
use lvk_tests::device_with;
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{GpuScene, Layout, Placed, RayScene};
use lvk_tests::ray_tracer::{How, MISSED, Method, RayTracer};
use lvk_tests::rays::Ray;

/// Numbers of instances: one workgroup builds the first TLAS, many build the second.
const COUNTS: [usize; 2] = [3, 3_000];

/// Returns the number of rays that hit something, for builds by the CPU and by the GPU, from a list and from a
/// buffer.
fn hits(tracer: &RayTracer, transform: Affine3A, count: usize) -> Result<[usize; 3]> {
    let ctx = tracer.context();
    let mut scene = RayScene::single(Mesh::sphere(8), Layout::Indexed16);
    scene.placed = vec![Placed::new(0, transform); count];
    let ray = |[x, y, z]: [i16; 3]| {
        let way = Vec3::new(f32::from(x), f32::from(y), f32::from(z));
        let direction = Vec3::new(0.3, 0.2, 0.9) * transform.matrix3.x_axis.length();
        Ray::new(transform.transform_point3(way * 0.2) - direction * 5.0, direction)
    };
    let places = (-2..3).flat_map(|x| (-2..3).flat_map(move |y| (-2..3).map(move |z| [x, y, z])));
    let rays: Vec<_> = places.map(ray).collect();
    let found = |gpu: &GpuScene| -> Result<usize> {
        let records = tracer.trace(&gpu.tlas, &rays, How::default())?;
        Ok(records.iter().filter(|record| record.kind != MISSED).count())
    };
    let upload =
        |scene: &RayScene, models| scene.upload_with(ctx, models, BuildFlags::default(), count as u32);
    // The CPU builds where it knows the bounds.
    let by_cpu = found(&upload(&scene, BuildFlags::FAST_TRACE)?)?;
    let by_gpu = found(&upload(&scene, BuildFlags::FAST_BUILD)?)?;
    let gpu = upload(&RayScene { placed: Vec::new(), ..scene.clone() }, BuildFlags::FAST_BUILD)?;
    update_from(ctx, &gpu, &scene.placed)?;
    Ok([by_cpu, by_gpu, found(&gpu)?])
}

/// Shows instances of the first model from a buffer.
fn update_from(ctx: &Context, gpu: &GpuScene, placed: &[Placed]) -> Result<()> {
    let record = |placed: &Placed| {
        let rows = transform_rows(&placed.transform).map(f32::to_bits);
        rows.into_iter().chain([u32::from(placed.mask) << 24, 0, 0, 0])
    };
    let records = words_buffer(ctx, &placed.iter().flat_map(record).collect::<Vec<_>>());
    let count = placed.len() as u32;
    let mut cmd = ctx.acquire_command_buffer()?;
    let source = DeviceInstances { buffer: *records, offset: 0, count, blas: &[*gpu.models[0]] };
    cmd.update_tlas_from_buffer(*gpu.tlas, &source, BuildMode::Rebuild)?;
    ctx.submit(cmd).map(drop)
}

#[test]
fn singular_matrices_are_never_hit() -> Result<()> {
    let Some(ctx) = device_with(|desc| desc.ray_query = RayQueryRequest::Software) else { return Ok(()) };
    let tracer = RayTracer::new(&ctx, Method::Query)?;
    let rows = Mat3::from_cols_array(&[1.0, 4.0, 7.0, 2.0, 5.0, 8.0, 3.0, 6.0, 9.0]);
    let scaled = |matrix: Mat3, scale: f32| Affine3A::from_mat3_translation(matrix * scale, Vec3::ONE);
    for count in COUNTS {
        for scale in [1e-6, 0.1, 1.0, 1e6] {
            assert_eq!(hits(&tracer, scaled(rows, scale), count)?, [0; 3], "{count} of {scale}");
            let turned = scaled(Mat3::from_rotation_y(0.7), scale);
            assert!(hits(&tracer, turned, count)?.iter().all(|hits| *hits > 20), "{count} of {scale}");
        }
    }
    Ok(())
}
