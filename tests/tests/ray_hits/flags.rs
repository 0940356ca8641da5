//! Masks, ray flags, instance flags and geometry flags in all combinations, against the f64 reference.

use lvk::glam::{Affine3A, Quat, Vec3};
use lvk::{DeviceProfile, GeometryFlags, InstanceFlags, Result};
use lvk_tests::hit_comparison::HitComparison;
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{Layout, Part, Placed, RayScene};
use lvk_tests::ray_tracer::{
    CULL_BACK, CULL_FRONT, CULL_NO_OPAQUE, CULL_OPAQUE, How, Method, NO_OPAQUE, OPAQUE, RayTracer,
    TERMINATE_ON_FIRST_HIT,
};
use lvk_tests::rays::{Ray, random_rays};
use lvk_tests::reference::Reference;
use lvk_tests::{TestDevice, device, device_with};

fn rays_for(reference: &Reference, count: usize) -> Vec<Ray> {
    let (low, high) = reference.bounds();
    random_rays(71, count, low.as_vec3(), high.as_vec3())
}

/// The device as it is, and one that cuts meshes of more than 40 triangles.
fn devices() -> Vec<TestDevice> {
    let profile = DeviceProfile { max_blas_primitives: 40, ..DeviceProfile::default() };
    device().into_iter().chain(device_with(|desc| desc.profile = Some(&profile))).collect()
}

/// A place on a grid three apart, turned by its number.
fn transform_of(index: u32) -> Affine3A {
    let at = Vec3::new((index % 4) as f32, (index / 4 % 4) as f32, (index / 16) as f32) * 2.4;
    Affine3A::from_rotation_translation(Quat::from_rotation_y(index as f32 * 0.7), at)
}

/// Two models, each a solid geometry and one with holes in it.
fn models() -> Vec<Vec<Part>> {
    let holes = |mesh, layout| Part { flags: GeometryFlags::empty(), ..Part::new(mesh, layout) };
    vec![
        vec![holes(Mesh::sphere(5), Layout::Indexed16), Part::new(Mesh::cube_grid(1), Layout::Unshared)],
        vec![Part::new(Mesh::terrain(4), Layout::Indexed32), holes(Mesh::torus(4), Layout::Interleaved)],
    ]
}

/// Every mask of a ray meets masks of instances with no, one, several and all bits.
#[test]
fn a_ray_sees_the_instances_that_share_a_bit_with_it() -> Result<()> {
    const MASKS: [u8; 14] = [0, 1, 2, 4, 8, 16, 32, 64, 128, 0xff, 0x55, 0xaa, 0x0f, 0x81];
    let Some(ctx) = device() else { return Ok(()) };
    let place = |(index, mask)| Placed { mask, ..Placed::new(0, transform_of(index)) };
    let scene = RayScene {
        models: vec![vec![Part::new(Mesh::cube_grid(1), Layout::Indexed16)]],
        placed: (0..).zip(MASKS).map(place).collect(),
    };
    let gpu = scene.upload(&ctx)?;
    let reference = scene.reference();
    let rays = rays_for(&reference, 240);
    for method in Method::available(&ctx) {
        let tracer = RayTracer::new(&ctx, method)?;
        let mut whole = HitComparison::default();
        for mask in 0..=0xff {
            let how = How { mask, ..How::default() };
            let records = tracer.trace(&gpu.tlas, &rays, how)?;
            whole.add(HitComparison::of_triangles(&rays, &records, |ray| reference.closest_by(ray, how)));
            let shadows = tracer.trace(&gpu.tlas, &rays, How { mask, ..How::shadows() })?;
            whole.add(HitComparison::of_occlusion(&rays, &shadows, |ray| reference.occluded(ray, mask)));
        }
        whole.assert(&format!("256 masks by {method:?}"));
        let blind = tracer.trace(&gpu.tlas, &rays, How { mask: 0, ..How::default() })?;
        assert!(blind.iter().all(|record| record.kind == 0), "the mask 0 sees nothing");
    }
    Ok(())
}

fn all_instance_flags() -> Vec<InstanceFlags> {
    let all = (0..16).map(InstanceFlags::from_bits_truncate);
    let contradiction = InstanceFlags::FORCE_OPAQUE | InstanceFlags::FORCE_NO_OPAQUE;
    all.filter(|flags| !flags.contains(contradiction)).collect()
}

/// Both models under all instance flags, every second time mirrored.
fn flagged() -> RayScene {
    let place = |(index, flags): (u32, InstanceFlags)| {
        let mirror = if index % 4 < 2 { 1.0 } else { -1.0 };
        let transform = transform_of(index) * Affine3A::from_scale(Vec3::new(mirror, 0.8, 1.1));
        Placed { flags, custom_index: 5 * index, ..Placed::new(index as usize % 2, transform) }
    };
    let twice = all_instance_flags().into_iter().flat_map(|flags| [flags, flags]);
    RayScene { models: models(), placed: (0..).zip(twice).map(place).collect() }
}

/// Triangles with odd numbers are looked through where a hit is not opaque, so that it shows what is.
fn check_flags(ctx: &TestDevice, method: Method, kinds: &[u32], sides: &[u32]) -> Result<()> {
    let scene = flagged();
    let gpu = scene.upload(ctx)?;
    let reference = scene.reference();
    let rays = rays_for(&reference, 700);
    let tracer = RayTracer::with_even_primitives(ctx, method)?;
    for flags in kinds.iter().flat_map(|kind| sides.iter().map(move |side| kind | side)) {
        let how = How { flags, ..How::default() };
        let answer = |ray: &Ray| {
            reference.closest_by_where(ray, how, |hit| hit.is_opaque || hit.ids.primitive & 1 == 0)
        };
        let records = tracer.trace(&gpu.tlas, &rays, how)?;
        HitComparison::of_triangles(&rays, &records, answer)
            .assert(&format!("flags {flags:#x} by {method:?}"));
        let occluded = |ray: &Ray| {
            let answer = answer(ray);
            answer.is_certain.then_some(answer.hit.is_some())
        };
        let first = How { flags: flags | TERMINATE_ON_FIRST_HIT, ..How::default() };
        let records = tracer.trace(&gpu.tlas, &rays, first)?;
        let what = format!("first hit, flags {flags:#x} by {method:?}");
        HitComparison::of_occlusion(&rays, &records, occluded).assert(&what);
    }
    Ok(())
}

#[test]
fn flags_of_ray_instance_and_geometry_decide_together() -> Result<()> {
    for ctx in devices() {
        for method in Method::available(&ctx) {
            let kinds = [0, OPAQUE, NO_OPAQUE, CULL_OPAQUE, CULL_NO_OPAQUE];
            check_flags(&ctx, method, &kinds, &[0, CULL_BACK, CULL_FRONT])?;
        }
    }
    Ok(())
}

/// An end of the ray and a flag of each kind, so that no flag undoes what another one says about the range.
#[test]
fn culled_triangles_end_no_ray() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let square = |z: f32| Mesh {
        positions: vec![[-4.0, -4.0, z], [4.0, -4.0, z], [4.0, 4.0, z], [-4.0, 4.0, z]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let part = |z, flags| Part { flags, ..Part::new(square(z), Layout::Indexed16) };
    let (solid, open) = (GeometryFlags::OPAQUE, GeometryFlags::empty());
    let models = vec![vec![part(1.0, solid), part(2.0, open), part(3.0, solid), part(4.0, open)]];
    let scene = RayScene { models, placed: vec![Placed::new(0, Affine3A::IDENTITY)] };
    let gpu = scene.upload(&ctx)?;
    let up = Ray::new(Vec3::new(0.5, 1.5, 0.0), Vec3::Z);
    let rays =
        [up, Ray { t_min: 2.5, ..up }, Ray { t_max: 1.5, ..up }, Ray { t_min: 3.5, t_max: 3.75, ..up }];
    for method in Method::available(&ctx) {
        let tracer = RayTracer::new(&ctx, method)?;
        for (flags, expected) in [
            (0, [1.0, 3.0, 1.0, 0.0]),
            (CULL_OPAQUE, [2.0, 4.0, 0.0, 0.0]),
            (CULL_NO_OPAQUE, [1.0, 3.0, 1.0, 0.0]),
            (CULL_OPAQUE | CULL_BACK, [0.0; 4]),
            (CULL_OPAQUE | CULL_FRONT, [2.0, 4.0, 0.0, 0.0]),
        ] {
            let records = tracer.trace(&gpu.tlas, &rays, How { flags, ..How::default() })?;
            let found: Vec<f32> = records.iter().map(|record| record.t).collect();
            assert_eq!(found, expected, "flags {flags:#x} by {method:?}");
        }
    }
    Ok(())
}
