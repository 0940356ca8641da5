//! Closest hits and shadows of thousands of rays, against the f64 reference, by pipeline and by query.

use std::error::Error;

use lvk::glam::{Affine3A, DVec3, Vec3};
use lvk_samples::app::progress::Progress;
use lvk_samples::scene::{ObjOptions, Scene};
use lvk_tests::device;
use lvk_tests::hit_comparison::HitComparison;
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{Layout, Part, Placed, RayScene};
use lvk_tests::ray_tracer::{CULL_BACK, CULL_FRONT, How, Method, OPAQUE, RayTracer};
use lvk_tests::rays::{Ray, camera_rays, random_rays};
use lvk_tests::reference::Reference;

type Outcome = Result<(), Box<dyn Error>>;

/// Returns rays of a camera, and rays from everywhere.
fn rays_for(reference: &Reference, seed: u64) -> Vec<Ray> {
    let (low, high) = reference.bounds();
    let (low, high) = (low.as_vec3(), high.as_vec3());
    let eye = (low + high) * 0.5 + Vec3::new(0.9, 0.7, 1.3) * (high - low).length() * 0.6;
    let mut rays = camera_rays(40, eye, (low + high) * 0.5);
    rays.extend(random_rays(seed, 1_800, low, high));
    rays
}

fn check(name: &str, scene: &RayScene) -> Outcome {
    let Some(ctx) = device() else { return Ok(()) };
    let gpu = scene.upload(&ctx)?;
    let reference = scene.reference();
    let rays = rays_for(&reference, 3);
    for method in Method::available(&ctx) {
        let tracer = RayTracer::new(&ctx, method)?;
        let records = tracer.trace(&gpu.tlas, &rays, How::default())?;
        HitComparison::of_triangles(&rays, &records, |ray| reference.closest(ray, 0xff))
            .assert(&format!("{name} by {method:?}"));
        let shadows = tracer.trace(&gpu.tlas, &rays, How::shadows())?;
        HitComparison::of_occlusion(&rays, &shadows, |ray| reference.occluded(ray, 0xff))
            .assert(&format!("{name}, shadows by {method:?}"));
    }
    Ok(())
}

#[test]
fn a_sphere_without_indices() -> Outcome {
    check("sphere", &RayScene::single(Mesh::sphere(20), Layout::Unshared))
}

#[test]
fn a_terrain_without_indices() -> Outcome {
    check("terrain", &RayScene::single(Mesh::terrain(28), Layout::Unshared))
}

#[test]
fn cubes_with_16_bit_indices() -> Outcome {
    check("cubes, u16", &RayScene::single(Mesh::cube_grid(4), Layout::Indexed16))
}

#[test]
fn cubes_with_32_bit_indices() -> Outcome {
    check("cubes, u32", &RayScene::single(Mesh::cube_grid(4), Layout::Indexed32))
}

#[test]
fn a_torus_from_an_obj_file() -> Outcome {
    let original = Mesh::torus(20);
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("torus.obj");
    std::fs::write(&path, original.obj_text())?;
    let loaded = Scene::from_obj(&path, &ObjOptions::default(), &mut Progress::hidden())?;
    assert_eq!(loaded.triangles.len(), original.triangles.len());
    let Some(ctx) = device() else { return Ok(()) };
    let mesh = Mesh { positions: loaded.positions.clone(), triangles: loaded.triangles.clone() };
    let gpu = RayScene::single(mesh, Layout::Indexed32).upload(&ctx)?;
    let reference = RayScene::single(original, Layout::Indexed32).reference();
    let rays = rays_for(&reference, 4);
    for method in Method::available(&ctx) {
        let mut records = RayTracer::new(&ctx, method)?.trace(&gpu.tlas, &rays, How::default())?;
        for record in records.iter_mut().filter(|record| record.kind != 0) {
            record.primitive = loaded.source_triangles[record.primitive as usize];
        }
        HitComparison::of_shapes(&rays, &records, |ray| reference.closest(ray, 0xff))
            .assert(&format!("torus, as in the file, by {method:?}"));
    }
    drop(gpu);
    drop(ctx);
    let mesh = Mesh { positions: loaded.positions, triangles: loaded.triangles };
    check("torus, as loaded", &RayScene::single(mesh, Layout::Indexed32))
}

#[test]
fn faces_are_culled_by_their_side() -> Outcome {
    let Some(ctx) = device() else { return Ok(()) };
    let mut scene = RayScene::single(Mesh::sphere(12), Layout::Indexed32);
    scene.models.push(vec![Part::new(Mesh::torus(10), Layout::Indexed32)]);
    let mirror = Affine3A::from_scale(Vec3::new(-0.8, 0.8, 0.8));
    let beside = Affine3A::from_translation(Vec3::new(2.5, 0.0, 0.0));
    scene.placed.push(Placed::new(1, beside * mirror));
    let gpu = scene.upload(&ctx)?;
    let reference = scene.reference();
    let rays = rays_for(&reference, 5);
    for method in Method::available(&ctx) {
        let tracer = RayTracer::new(&ctx, method)?;
        for (flags, front) in [(CULL_BACK, true), (CULL_FRONT, false)] {
            let records = tracer.trace(&gpu.tlas, &rays, How { flags: flags | OPAQUE, ..How::default() })?;
            let answer = |ray: &Ray| reference.closest_where(ray, 0xff, |hit| hit.is_front == front);
            let what = format!("only {} faces by {method:?}", if front { "front" } else { "back" });
            HitComparison::of_triangles(&rays, &records, answer).assert(&what);
        }
    }
    Ok(())
}

/// A ray of which every number is exact in f32 too, towards a square at z = 0.
#[test]
fn a_hit_lies_between_the_ends_of_a_ray() -> Outcome {
    let Some(ctx) = device() else { return Ok(()) };
    let square = Mesh {
        positions: vec![[-4.0, -4.0, 0.0], [4.0, -4.0, 0.0], [4.0, 4.0, 0.0], [-4.0, 4.0, 0.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let scene = RayScene::single(square, Layout::Indexed16);
    let gpu = scene.upload(&ctx)?;
    assert_eq!(scene.reference().bounds(), (DVec3::new(-4.0, -4.0, 0.0), DVec3::new(4.0, 4.0, 0.0)));
    let ray = Ray::new(Vec3::new(1.0, 2.0, -2.0), Vec3::Z * 0.5);
    let (before, after) = (4.0_f32.next_down(), 4.0_f32.next_up());
    let expected = [(0.0, 10.0, true), (before, after, true), (after, 10.0, false), (0.0, before, false)];
    let rays: Vec<_> =
        expected.iter().map(|(t_min, t_max, _)| Ray { t_min: *t_min, t_max: *t_max, ..ray }).collect();
    for method in Method::available(&ctx) {
        let records = RayTracer::new(&ctx, method)?.trace(&gpu.tlas, &rays, How::default())?;
        let hits: Vec<_> = records.iter().map(|record| record.kind != 0).collect();
        assert_eq!(hits, expected.map(|(_, _, is_hit)| is_hit), "by {method:?}");
        assert_eq!((records[0].t, records[0].primitive, records[0].barycentrics), (4.0, 1, [0.625, 0.125]));
    }
    Ok(())
}
