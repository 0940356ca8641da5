//! Triangles that no ray can hit (without area, or with NaN vertices) and empty geometries: they change no other hit
//! and no other number.

use lvk::glam::{Affine3A, Vec3};
use lvk::{BuildFlags, BuildMode, DeviceProfile, Result};
use lvk_tests::device::loses_neighbours_of_inactive;
use lvk_tests::hit_check::{HitCheck, rays_for};
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{GpuScene, Layout, Part, Placed, RayScene, instances, vertex_bytes};
use lvk_tests::ray_tracer::{HitRecord, How, MISSED};
use lvk_tests::rays::random_rays;
use lvk_tests::reference::{Hit, HitIds};
use lvk_tests::{TestDevice, device, device_with};

const LAYOUTS: [Layout; 4] = [Layout::Unshared, Layout::Indexed16, Layout::Indexed32, Layout::Interleaved];

fn devices() -> Vec<TestDevice> {
    let profile = DeviceProfile { max_blas_primitives: 30, ..DeviceProfile::default() };
    device().into_iter().chain(device_with(|desc| desc.profile = Some(&profile))).collect()
}

fn nothing() -> Mesh {
    Mesh { positions: Vec::new(), triangles: Vec::new() }
}

/// A torus with triangles among its own that have no area: points, lines, two corners in one place.
fn with_slivers() -> Mesh {
    let mut mesh = Mesh::torus(8);
    let all = mesh.triangles.clone();
    mesh.triangles.clear();
    for (index, [a, b, c]) in all.into_iter().enumerate() {
        mesh.triangles.push([a, b, c]);
        match index % 5 {
            0 => mesh.triangles.push([a, a, a]),
            1 => mesh.triangles.push([a, b, b]),
            2 => mesh.triangles.push([c, b, c]),
            _ => {}
        }
    }
    let first = mesh.positions.len() as u32;
    mesh.positions.extend([[0.0, -3.0, 0.0], [0.0, 0.0, 0.0], [0.0, 3.0, 0.0]]);
    mesh.triangles.extend([[first, first + 1, first + 2]; 3]);
    mesh
}

/// A torus of which every seventh triangle has a corner whose x coordinate is not a number.
fn with_inactive() -> Mesh {
    let mut mesh = Mesh::torus(8).unshared();
    for (index, triangle) in mesh.triangles.iter().enumerate().filter(|(index, _)| index % 7 == 3) {
        mesh.positions[triangle[index % 3] as usize][0] = f32::NAN;
    }
    mesh
}

fn beside(model: usize, index: u32) -> Placed {
    let transform = Affine3A::from_translation(Vec3::new(index as f32 * 3.0, 0.0, 0.0));
    Placed { custom_index: 30 + index, ..Placed::new(model, transform) }
}

/// A model for each layout, of the mesh and a cube, side by side.
fn beside_cubes(mesh: fn() -> Mesh) -> RayScene {
    let model = |layout| vec![Part::new(mesh(), layout), Part::new(Mesh::cube_grid(1), layout)];
    let models = LAYOUTS.map(model).to_vec();
    RayScene { models, placed: (0..4).map(|index| beside(index as usize, index)).collect() }
}

#[test]
fn triangles_without_area_are_not_hit() -> Result<()> {
    for ctx in devices() {
        let check = HitCheck::new(&ctx)?;
        let scene = beside_cubes(with_slivers);
        check.scene("without area", &scene.upload(&ctx)?.tlas, &scene)?;
    }
    Ok(())
}

#[test]
fn inactive_triangles_are_not_hit() -> Result<()> {
    for ctx in devices() {
        let check = HitCheck::new(&ctx)?;
        let scene = beside_cubes(with_inactive);
        let gpu = scene.upload(&ctx)?;
        if loses_neighbours_of_inactive(&ctx) {
            check_found(&check, &gpu, &scene)?;
        } else {
            check.scene("inactive", &gpu.tlas, &scene)?;
        }
    }
    Ok(())
}

/// Asserts that every hit is among the hits of the reference, by its numbers and its distance.
fn check_found(check: &HitCheck, gpu: &GpuScene, scene: &RayScene) -> Result<()> {
    let reference = scene.reference();
    let rays = rays_for(&reference);
    for (method, tracer) in check.tracers() {
        let records = tracer.trace(&gpu.tlas, &rays, How::default())?;
        let mut found = 0;
        for (ray, record) in rays.iter().zip(&records).filter(|(_, record)| record.kind != MISSED) {
            let Some(hits) = reference.all_hits(ray, How::default()) else { continue };
            let HitRecord { instance, custom_index, geometry, primitive, .. } = *record;
            let ids = HitIds { instance, custom_index, geometry, primitive };
            let t = f64::from(record.t);
            let is_there = |hit: &Hit| hit.ids == ids && (hit.t - t).abs() <= 1e-5 * t.max(1.0);
            assert!(hits.iter().any(is_there), "{method:?}: {record:?} is none of {hits:?}");
            found += 1;
        }
        assert!(found * 10 > rays.len(), "{method:?}: {found} hits");
    }
    Ok(())
}

#[test]
fn geometries_of_nothing_keep_their_numbers() -> Result<()> {
    for ctx in devices() {
        let check = HitCheck::new(&ctx)?;
        for layout in LAYOUTS {
            let part = |mesh| Part::new(mesh, layout);
            let models = vec![
                vec![
                    part(nothing()),
                    part(Mesh::torus(6)),
                    part(nothing()),
                    part(Mesh::cube_grid(1)),
                    part(nothing()),
                ],
                vec![part(nothing())],
                vec![part(nothing()), part(nothing())],
                vec![part(Mesh::sphere(5))],
            ];
            let placed = (0..8).map(|index| beside(index as usize % 4, index)).collect();
            let scene = RayScene { models, placed };
            let gpu = scene.upload_with(&ctx, BuildFlags::FAST_BUILD, BuildFlags::FAST_BUILD, 0)?;
            check.scene(&format!("with nothing, {layout:?}"), &gpu.tlas, &scene)?;
        }
    }
    Ok(())
}

#[test]
fn a_world_of_nothing_is_missed() -> Result<()> {
    for ctx in devices() {
        let check = HitCheck::new(&ctx)?;
        let models =
            vec![vec![Part::new(nothing(), Layout::Indexed16)], vec![Part::new(nothing(), Layout::Unshared)]];
        let rays = random_rays(97, 64, Vec3::NEG_ONE, Vec3::ONE);
        for count in [0, 1, 5] {
            let placed = (0..count).map(|index| beside(index as usize % 2, index)).collect();
            let scene = RayScene { models: models.clone(), placed };
            let gpu = scene.upload_with(&ctx, BuildFlags::ALLOW_UPDATE, BuildFlags::ALLOW_UPDATE, 9)?;
            for mode in [BuildMode::Rebuild, BuildMode::Refit, BuildMode::Auto { max_refits: 1 }] {
                build(&ctx, &gpu, &scene, mode)?;
                for (_, tracer) in check.tracers() {
                    let records = tracer.trace(&gpu.tlas, &rays, How::default())?;
                    assert!(
                        records.iter().all(|record| record.kind == MISSED),
                        "{count} of nothing, {mode:?}"
                    );
                }
            }
        }
    }
    Ok(())
}

fn build(ctx: &TestDevice, gpu: &GpuScene, scene: &RayScene, mode: BuildMode) -> Result<()> {
    let mut cmd = ctx.acquire_command_buffer()?;
    let models: Vec<_> = gpu.models.iter().map(|model| **model).collect();
    cmd.build_blas(&models, mode)?;
    cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), mode)?;
    ctx.submit(cmd)?;
    Ok(())
}

/// True if a triangle is folded up, by an x coordinate of its.
type Folded = fn(f32) -> bool;

/// The number of primitives stays, but which of them have an area changes from build to build.
#[test]
fn triangles_become_degenerate_and_recover() -> Result<()> {
    for ctx in devices() {
        let check = HitCheck::new(&ctx)?;
        let mut scene = RayScene::single(Mesh::torus(8).unshared(), Layout::Unshared);
        let whole = scene.models[0][0].mesh.clone();
        let flags = BuildFlags::FAST_TRACE | BuildFlags::ALLOW_UPDATE;
        let gpu = scene.upload_with(&ctx, flags, flags, 0)?;
        let half = |mesh: &Mesh, folded: Folded| {
            let mut mesh = mesh.clone();
            for corners in
                mesh.positions.as_chunks_mut::<3>().0.iter_mut().filter(|corners| folded(corners[0][0]))
            {
                *corners = [[0.0, 5.0, 0.0]; 3];
            }
            mesh
        };
        let shapes: [(&str, Folded, BuildMode); 4] = [
            ("left, refitted", |x| x > 0.0, BuildMode::Refit),
            ("right, rebuilt", |x| x < 0.0, BuildMode::Rebuild),
            ("left again", |x| x > 0.2, BuildMode::Rebuild),
            ("whole", |_| false, BuildMode::Refit),
        ];
        for (what, folded, mode) in shapes {
            scene.models[0][0].mesh = half(&whole, folded);
            let bytes = vertex_bytes(&scene.models[0][0].mesh, Layout::Unshared);
            ctx.upload_buffer(*gpu.buffers[0].vertices, 0, &bytes)?;
            build(&ctx, &gpu, &scene, mode)?;
            check.scene(what, &gpu.tlas, &scene)?;
        }
    }
    Ok(())
}
