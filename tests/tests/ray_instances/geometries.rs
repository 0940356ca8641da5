//! Several geometries and instances, transforms of both, masks and front faces, against the f64 reference.

use lvk::glam::{Affine3A, Quat, Vec3};
use lvk::{GeometryFlags, InstanceFlags, Result};
use lvk_tests::hit_comparison::HitComparison;
use lvk_tests::meshes::Mesh;
use lvk_tests::random::Random;
use lvk_tests::ray_scene::{Layout, Part, Placed, RayScene};
use lvk_tests::ray_tracer::{How, Method, RayTracer};
use lvk_tests::rays::{Ray, random_rays};
use lvk_tests::reference::Reference;
use lvk_tests::{device, device_with};

fn rays_for(reference: &Reference) -> Vec<Ray> {
    let (low, high) = reference.bounds();
    random_rays(11, 2_400, low.as_vec3(), high.as_vec3())
}

fn turned(angle: f32, scale: Vec3, to: Vec3) -> Affine3A {
    let turn = Quat::from_axis_angle(Vec3::new(1.0, 2.0, -0.5).normalize(), angle);
    Affine3A::from_scale_rotation_translation(scale, turn, to)
}

/// Models of one to four geometries in all layouts, some with a transform of their own, one of them mirrored.
fn models() -> Vec<Vec<Part>> {
    let moved = |mesh, layout, transform| Part { transform: Some(transform), ..Part::new(mesh, layout) };
    vec![
        vec![
            Part::new(Mesh::sphere(8), Layout::Unshared),
            moved(
                Mesh::cube_grid(2),
                Layout::Indexed16,
                Affine3A::from_translation(Vec3::new(0.0, 2.0, 0.0)),
            ),
            moved(Mesh::torus(7), Layout::Interleaved, turned(0.7, Vec3::new(1.0, 0.5, 1.5), Vec3::X)),
            moved(Mesh::terrain(6), Layout::Indexed32, turned(2.0, Vec3::new(1.5, -1.0, 1.0), Vec3::NEG_Y)),
        ],
        vec![Part::new(Mesh::torus(8), Layout::Interleaved), Part::new(Mesh::cube_grid(1), Layout::Unshared)],
        vec![Part::new(Mesh::terrain(9), Layout::Indexed16)],
    ]
}

fn scene() -> RayScene {
    let mut random = Random::new(21);
    let mut placed = Vec::new();
    for index in 0..12_u32 {
        let mut scale = random.point(Vec3::splat(0.5), Vec3::splat(1.6));
        if index % 3 == 1 {
            scale.x = -scale.x;
        }
        let to = random.point(Vec3::splat(-5.0), Vec3::splat(5.0));
        let transform = turned(random.between(0.0, 6.0), scale, to);
        placed.push(Placed {
            custom_index: 0xff_ffff - index * 1_000,
            mask: 1 << (index % 4),
            flags: if index % 5 == 2 { InstanceFlags::FLIP_FACING } else { InstanceFlags::empty() },
            ..Placed::new(index as usize % 3, transform)
        });
    }
    RayScene { models: models(), placed }
}

#[test]
fn geometries_and_instances_keep_their_numbers() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let scene = scene();
    let gpu = scene.upload(&ctx)?;
    let reference = scene.reference();
    let rays = rays_for(&reference);
    let seen = |index: fn(&lvk_tests::reference::HitIds) -> u32| {
        let ids = rays.iter().filter_map(|ray| reference.closest(ray, 0xff).hit);
        ids.map(|hit| index(&hit.ids)).collect::<std::collections::HashSet<_>>().len()
    };
    assert_eq!((seen(|ids| ids.instance), seen(|ids| ids.geometry)), (12, 4), "the rays reach everything");
    for method in Method::available(&ctx) {
        let tracer = RayTracer::new(&ctx, method)?;
        let records = tracer.trace(&gpu.tlas, &rays, How::default())?;
        HitComparison::of_triangles(&rays, &records, |ray| reference.closest(ray, 0xff))
            .assert(&format!("instances by {method:?}"));
    }
    Ok(())
}

#[test]
fn masks_choose_instances() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let scene = scene();
    let gpu = scene.upload(&ctx)?;
    let reference = scene.reference();
    let rays = rays_for(&reference);
    for method in Method::available(&ctx) {
        let tracer = RayTracer::new(&ctx, method)?;
        for mask in [0b0001, 0b0110, 0b1101] {
            let what = format!("mask {mask:#b} by {method:?}");
            let records = tracer.trace(&gpu.tlas, &rays, How { mask, ..How::default() })?;
            HitComparison::of_triangles(&rays, &records, |ray| reference.closest(ray, mask)).assert(&what);
            let shadows = tracer.trace(&gpu.tlas, &rays, How { mask, ..How::shadows() })?;
            HitComparison::of_occlusion(&rays, &shadows, |ray| reference.occluded(ray, mask)).assert(&what);
        }
        let none = tracer.trace(&gpu.tlas, &rays, How { mask: 0b1111_0000, ..How::default() })?;
        assert!(none.iter().all(|record| record.kind == 0), "no instance has these bits");
    }
    Ok(())
}

#[test]
fn overlapping_instances_keep_their_numbers() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let scene = RayScene::scattered(GeometryFlags::OPAQUE);
    let gpu = scene.upload(&ctx)?;
    let reference = scene.reference();
    let rays = rays_for(&reference);
    for method in Method::available(&ctx) {
        let tracer = RayTracer::new(&ctx, method)?;
        for mask in [0xff, 0b101] {
            let what = format!("mask {mask:#b} by {method:?}");
            let records = tracer.trace(&gpu.tlas, &rays, How { mask, ..How::default() })?;
            HitComparison::of_triangles(&rays, &records, |ray| reference.closest(ray, mask)).assert(&what);
            let shadows = tracer.trace(&gpu.tlas, &rays, How { mask, ..How::shadows() })?;
            HitComparison::of_occlusion(&rays, &shadows, |ray| reference.occluded(ray, mask)).assert(&what);
        }
    }
    Ok(())
}

/// Every build is over the scratch budget by itself, so each is a batch of its own.
#[test]
fn many_accel_structs_are_built_whatever_the_scratch_budget() -> Result<()> {
    for budget in [1, 200 << 10] {
        let Some(ctx) = device_with(|desc| desc.scratch_budget_bytes = budget) else { return Ok(()) };
        let part = |size: u32| vec![Part::new(Mesh::sphere(4 + size % 5), Layout::Indexed16)];
        let place = |index: u32| {
            let (x, y) = ((index % 6) as f32 * 2.2, (index / 6) as f32 * 2.2);
            let transform = Affine3A::from_translation(Vec3::new(x, y, 0.3 * x));
            Placed { custom_index: index, ..Placed::new(index as usize, transform) }
        };
        let scene = RayScene { models: (0..30).map(part).collect(), placed: (0..30).map(place).collect() };
        let gpu = scene.upload(&ctx)?;
        let reference = scene.reference();
        let rays = rays_for(&reference);
        for method in Method::available(&ctx) {
            let records = RayTracer::new(&ctx, method)?.trace(&gpu.tlas, &rays, How::default())?;
            HitComparison::of_triangles(&rays, &records, |ray| reference.closest(ray, 0xff))
                .assert(&format!("30 structures, {budget} bytes of scratch, by {method:?}"));
        }
    }
    Ok(())
}

/// Any-hit shaders and query candidates see what is not opaque, by geometry and by instance.
#[test]
fn an_any_hit_shader_looks_through_what_is_not_opaque() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let see_through = |mesh| Part { flags: GeometryFlags::empty(), ..Part::new(mesh, Layout::Indexed16) };
    let solid = |mesh| Part::new(mesh, Layout::Indexed16);
    let models =
        vec![vec![see_through(Mesh::sphere(10)), solid(Mesh::cube_grid(1))], vec![solid(Mesh::torus(9))]];
    let at = |x: f32, model, flags| {
        let transform = Affine3A::from_translation(Vec3::new(x, 0.0, 0.0));
        Placed { flags, ..Placed::new(model, transform) }
    };
    let placed = vec![
        at(0.0, 0, InstanceFlags::empty()),
        at(2.2, 0, InstanceFlags::FORCE_OPAQUE),
        at(4.8, 1, InstanceFlags::FORCE_NO_OPAQUE),
        at(7.6, 1, InstanceFlags::empty()),
    ];
    let scene = RayScene { models, placed };
    let gpu = scene.upload(&ctx)?;
    let reference = scene.reference();
    let rays = rays_for(&reference);
    let has_holes = |instance, geometry| matches!((instance, geometry), (0, 0) | (2, _));
    for method in Method::available(&ctx) {
        let tracer = RayTracer::with_even_primitives(&ctx, method)?;
        let records = tracer.trace(&gpu.tlas, &rays, How::default())?;
        let answer = |ray: &Ray| {
            reference.closest_where(ray, 0xff, |hit| {
                hit.ids.primitive & 1 == 0 || !has_holes(hit.ids.instance, hit.ids.geometry)
            })
        };
        HitComparison::of_triangles(&rays, &records, answer).assert(&format!("holes by {method:?}"));
    }
    Ok(())
}

#[test]
fn an_empty_accel_struct_is_missed_by_every_ray() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let tlas = ctx.create_tlas(&lvk::TlasDesc::default())?;
    let rays = random_rays(1, 100, Vec3::NEG_ONE, Vec3::ONE);
    for method in Method::available(&ctx) {
        let records = RayTracer::new(&ctx, method)?.trace(&tlas, &rays, How::default())?;
        assert!(records.iter().all(|record| record.kind == 0));
    }
    Ok(())
}
