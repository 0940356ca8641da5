//! Short ray directions in large scenes: rays along an axis whose distances to the planes of AABBs come near the
//! limits of f32.

use lvk::glam::{Affine3A, Vec3};
use lvk::{Context, RayQueryRequest, Result};
use lvk_tests::device_with;
use lvk_tests::hit_comparison::HitComparison;
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{Layout, Placed, RayScene};
use lvk_tests::ray_tracer::{How, Method, RayTracer};
use lvk_tests::rays::Ray;

/// The scale of the instance, that of its mesh, and the length of directions: as far as the manual says that rays hit.
const CASES: [[f32; 3]; 11] = [
    [1.0, 1.0, 1e-10],
    [1e6, 1.0, 1e-10],
    [1e8, 1.0, 1e-10],
    [1e10, 1.0, 1e-10],
    [1e12, 1.0, 1e-7],
    [1.0, 1e6, 1e-10],
    [1.0, 1e9, 1e-10],
    [1.0, 1e12, 1e-7],
    [1.0, 1e14, 1e-5],
    [1.0, 1e14, 1.0],
    [1e6, 1e6, 1e-4],
];

/// Rays across a scene of the given size, along an axis and a little askew, of unit length, from outside and from within.
fn rays_across(size: f32) -> Vec<Ray> {
    let askew = Vec3::new(0.01, 1.0, 0.02).normalize();
    let across = |i: u16| {
        let along = [Vec3::Y, -Vec3::Y, askew][usize::from(i % 3)];
        let from = if i.is_multiple_of(2) { 4.0 } else { 0.1 };
        let place = Vec3::new(0.01 * f32::from(i) - 1.3, 0.0, 0.2);
        Ray { t_max: 10.0 * size, ..Ray::new((place - from * along) * size, along) }
    };
    (0..270).map(across).collect()
}

fn check(ctx: &Context, tracers: &[RayTracer], case: [f32; 3]) -> Result<()> {
    let [scale, size, length] = case;
    let mut mesh = Mesh::torus(8);
    mesh.positions.as_flattened_mut().iter_mut().for_each(|coordinate| *coordinate *= size);
    let placed = vec![Placed::new(0, Affine3A::from_scale(Vec3::splat(scale)))];
    let scene = RayScene { placed, ..RayScene::single(mesh, Layout::Indexed16) };
    let gpu = scene.upload(ctx)?;
    let reference = scene.reference();
    let rays = rays_across(scale * size);
    let shortened: Vec<_> = rays.iter().map(|ray| shortened(ray, length)).collect();
    for tracer in tracers {
        let mut records = tracer.trace(&gpu.tlas, &shortened, How::default())?;
        records.iter_mut().for_each(|record| record.t *= length);
        let what = format!("instances {scale:e}, meshes {size:e}, directions {length:e}");
        HitComparison::of_triangles(&rays, &records, |ray| reference.closest(ray, 0xff)).assert(&what);
    }
    Ok(())
}

fn shortened(ray: &Ray, length: f32) -> Ray {
    Ray { t_max: ray.t_max / length, direction: ray.direction.map(|part| part * length), ..*ray }
}

#[test]
fn short_directions_hit_in_large_scenes() -> Result<()> {
    let Some(ctx) = device_with(|desc| desc.ray_query = RayQueryRequest::Software) else { return Ok(()) };
    let tracers = [RayTracer::new(&ctx, Method::Query)?, RayTracer::for_opaque_triangles(&ctx)?];
    CASES.into_iter().try_for_each(|case| check(&ctx, &tracers, case))
}
