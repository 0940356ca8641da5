//! Random overlapping instances: of every size, rotated, mirrored, flat, with different masks and BLASes.

use lvk::glam::{Affine3A, Quat, Vec3};
use lvk::{BuildFlags, GeometryFlags, InstanceFlags, Result};
use lvk_tests::device;
use lvk_tests::hit_check::HitCheck;
use lvk_tests::hit_comparison::HitComparison;
use lvk_tests::meshes::Mesh;
use lvk_tests::random::Random;
use lvk_tests::ray_scene::{GpuScene, Layout, Part, Placed, RayScene};
use lvk_tests::ray_tracer::{CULL_BACK, CULL_OPAQUE, How};
use lvk_tests::rays::random_rays;

/// Models of meshes with gaps inside or between their parts, so that AABBs say little about their contents.
fn models() -> Vec<Vec<Part>> {
    let apart = |mesh: Mesh, to: [f32; 3], flags| Part {
        flags,
        transform: Some(Affine3A::from_translation(to.into())),
        ..Part::new(mesh, Layout::Indexed16)
    };
    let opaque = GeometryFlags::OPAQUE;
    vec![
        vec![Part::new(Mesh::torus(5), Layout::Indexed16)],
        vec![Part::new(Mesh::cube_grid(2), Layout::Unshared)],
        vec![
            apart(Mesh::sphere(4), [-1.5, 0.0, 0.5], opaque),
            apart(Mesh::torus(4), [1.0, 1.5, 0.0], GeometryFlags::empty()),
            apart(Mesh::sphere(3), [0.0, -1.0, -2.0], opaque),
        ],
        vec![Part::new(Mesh::terrain(6), Layout::Interleaved)],
    ]
}

/// One in sixteen is large, one in sixteen flat as a sheet.
fn scale(number: u32, random: &mut Random) -> Vec3 {
    let size = match number % 16 {
        3 => random.between(6.0, 15.0),
        _ => random.between(0.5, 2.0),
    };
    let uneven = random.point(Vec3::splat(0.5), Vec3::ONE);
    let flat = if number % 16 == 7 { Vec3::new(1.0, 0.05, 1.0) } else { Vec3::ONE };
    let side = |bit: u32| if number >> bit & 1 == 0 { 1.0 } else { -1.0 };
    uneven * flat * Vec3::new(side(1), side(4), side(5)) * size
}

/// Turned between two uneven scales, which shears.
fn transform(number: u32, random: &mut Random) -> Affine3A {
    let first = Quat::from_axis_angle(random.direction(), random.between(0.0, 6.0));
    let shear = random.point(Vec3::splat(0.7), Vec3::splat(1.3));
    let turn = Quat::from_axis_angle(random.direction(), random.between(0.0, 6.0));
    let to = random.point(Vec3::splat(-4.0), Vec3::splat(4.0));
    let inner = Affine3A::from_scale(shear) * Affine3A::from_quat(first);
    Affine3A::from_scale_rotation_translation(scale(number, random), turn, to) * inner
}

fn flags(random: &mut Random) -> InstanceFlags {
    let flags = InstanceFlags::from_bits_truncate(random.bits() as u8);
    match flags.contains(InstanceFlags::FORCE_OPAQUE) {
        true => flags.difference(InstanceFlags::FORCE_NO_OPAQUE), // both are not allowed
        false => flags,
    }
}

/// Random instances. No ray sees those without a mask, nor those that are only a point.
fn scene(seed: u64, count: u32) -> RayScene {
    let random = &mut Random::new(seed);
    let models = models();
    let mut place = |number: u32| {
        let transform = transform(number, random);
        let transform = match number % 16 {
            11 => Affine3A::from_translation(transform.translation.into()) * Affine3A::from_scale(Vec3::ZERO),
            _ => transform,
        };
        let mask = if number % 16 == 13 { 0 } else { 1 << (random.bits() % 8) };
        let model = random.bits() as usize % models.len();
        Placed { custom_index: 5000 - number, mask, flags: flags(random), ..Placed::new(model, transform) }
    };
    let placed = (0..count).map(&mut place).collect();
    RayScene { models, placed }
}

/// Closest hits of different rays, and whether there is any.
fn check(check: &HitCheck, what: &str, scene: &RayScene, gpu: &GpuScene) -> Result<()> {
    let reference = scene.reference();
    // The reference asks every instance, so thousands of them get fewer rays.
    let rays = (900_000 / scene.placed.len()).min(1_500);
    let rays = random_rays(205, rays, Vec3::splat(-5.0), Vec3::splat(5.0));
    for (mask, flags) in [(0xff, 0), (0x25, 0), (0xff, CULL_BACK), (0xff, CULL_OPAQUE)] {
        let how = How { mask, flags, ..How::default() };
        let what = format!("{what}, mask {mask:#x}, flags {flags:#x}");
        check.closest(&what, &gpu.tlas, &rays, how, |ray| reference.closest_by(ray, how))?;
    }
    let how = How { mask: 0x73, ..How::shadows() };
    let opaque = check.opaque_tracer(how.flags).map(|tracer| ("all taken for opaque".to_owned(), tracer));
    let tracers = check.tracers().map(|(method, tracer)| (format!("by {method:?}"), tracer));
    for (by, tracer) in tracers.chain(opaque) {
        let records = tracer.trace(&gpu.tlas, &rays, how)?;
        let what = format!("{what}, shadows {by}");
        HitComparison::of_occlusion(&rays, &records, |ray| reference.occluded(ray, how.mask)).assert(&what);
    }
    Ok(())
}

/// Few instances and thousands, TLASes of the CPU, which shows overlapping ones in parts, and of the GPU.
#[test]
fn random_instances_that_overlap_are_hit() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let hit_check = HitCheck::new(&ctx)?;
    let top = [BuildFlags::default(), BuildFlags::FAST_BUILD | BuildFlags::ALLOW_UPDATE];
    for (seed, count) in [(201, 16), (202, 150), (203, 600), (204, 3_000)] {
        let scene = scene(seed, count);
        for (top, models) in top.into_iter().zip([BuildFlags::default(), BuildFlags::LOW_MEMORY]) {
            let gpu = scene.upload_with(&ctx, models, top, 0)?;
            check(&hit_check, &format!("{count} instances, {top:?}"), &scene, &gpu)?;
        }
    }
    Ok(())
}
