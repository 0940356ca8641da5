//! Meshes whose primitives the library reorders: shaders see the original primitive numbers.

use lvk::glam::{Affine3A, Quat, Vec3};
use lvk::{
    AccelStructInfo, BlasDesc, BuildFlags, BuildMode, Context, GeometryFlags, PrimitiveOrder, Result,
    TlasDesc,
};
use lvk_tests::accel_backend::builds_device_accel_structs;
use lvk_tests::device;
use lvk_tests::hit_check::{HitCheck, rays_for};
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{GpuScene, Layout, Part, Placed, RayScene, instances, upload_geometries};
use lvk_tests::ray_tracer::{How, MISSED};
use lvk_tests::rays::{Ray, random_rays};
use lvk_tests::sphere_scene::{GROUPS, SphereModel};
use lvk_tests::vertex_deform::{VertexDeformer, deformed};

/// As the mesh, but neighbours in space are far from each other in the list.
fn shuffled(mesh: &Mesh) -> Mesh {
    let count = mesh.triangles.len();
    let triangles = (0..count).map(|index| mesh.triangles[index * 211 % count]).collect();
    Mesh { positions: mesh.positions.clone(), triangles }
}

/// As the mesh, each half of the list on one side of the longest axis, and so on within the halves.
fn well_ordered(mesh: &Mesh) -> Mesh {
    let mut triangles = mesh.triangles.clone();
    halve(&mut triangles, &mesh.positions);
    Mesh { positions: mesh.positions.clone(), triangles }
}

fn halve(triangles: &mut [[u32; 3]], positions: &[[f32; 3]]) {
    if triangles.len() < 3 {
        return;
    }
    let center = |triangle: &[u32; 3]| {
        triangle.map(|corner| Vec3::from(positions[corner as usize])).iter().sum::<Vec3>()
    };
    let empty = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (low, high) = triangles.iter().map(center).fold(empty, |(low, high), at| (low.min(at), high.max(at)));
    let axis = (high - low).max_position();
    triangles.sort_by(|a, b| center(a)[axis].total_cmp(&center(b)[axis]));
    let (left, right) = triangles.split_at_mut(triangles.len().div_ceil(2));
    halve(left, positions);
    halve(right, positions);
}

/// Three instances of a shuffled mesh of two geometries, one of them seen through.
fn scene() -> RayScene {
    let ring = Part::new(shuffled(&Mesh::torus(11)), Layout::Indexed16);
    let ball = Part {
        flags: GeometryFlags::empty(),
        transform: Some(Affine3A::from_translation(Vec3::Y * 1.7)),
        ..Part::new(shuffled(&Mesh::sphere(9)), Layout::Unshared)
    };
    let place = |index: u32| {
        let turn = Quat::from_rotation_x(index as f32);
        let transform = Affine3A::from_rotation_translation(turn, Vec3::X * 3.0 * index as f32);
        Placed { custom_index: 40 + index, ..Placed::new(0, transform) }
    };
    RayScene { models: vec![vec![ring, ball]], placed: (0..3).map(place).collect() }
}

fn upload(ctx: &Context, scene: &RayScene, flags: BuildFlags, order: PrimitiveOrder) -> Result<GpuScene> {
    let (buffers, geometries) = upload_geometries(ctx, &scene.models[0])?;
    let models =
        vec![ctx.create_blas(&BlasDesc { geometries: &geometries, flags, order, ..Default::default() })?];
    let shown = instances(&scene.placed, &models);
    let desc = TlasDesc {
        instances: &shown,
        flags: BuildFlags::FAST_TRACE | BuildFlags::ALLOW_UPDATE,
        ..Default::default()
    };
    Ok(GpuScene { tlas: ctx.create_tlas(&desc)?, models, buffers })
}

fn info_of(ctx: &Context, mesh: &Mesh, flags: BuildFlags, order: PrimitiveOrder) -> Result<AccelStructInfo> {
    let gpu = upload(ctx, &RayScene::single(mesh.clone(), Layout::Indexed32), flags, order)?;
    ctx.accel_struct_info(*gpu.models[0])
}

#[test]
fn primitives_in_another_order_keep_their_numbers() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let (check, with_even_primitives) = (HitCheck::new(&ctx)?, HitCheck::with_even_primitives(&ctx)?);
    let scene = scene();
    let reference = scene.reference();
    let rays = rays_for(&reference);
    for (order, remapped) in [
        (PrimitiveOrder::Spatial, builds_device_accel_structs(&ctx)),
        (PrimitiveOrder::Auto, builds_device_accel_structs(&ctx) && ctx.capabilities().prefers_spatial_order),
        (PrimitiveOrder::Given, false),
    ] {
        let gpu = upload(&ctx, &scene, BuildFlags::FAST_TRACE, order)?;
        let info = ctx.accel_struct_info(*gpu.models[0])?;
        assert_eq!((info.parts, info.is_remapped), (1, remapped), "{order:?}");
        check.scene(&format!("{order:?}"), &gpu.tlas, &scene)?;
        let answer = |ray: &Ray| {
            reference
                .closest_where(ray, 0xff, |hit| hit.ids.geometry == 0 || hit.ids.primitive.is_multiple_of(2))
        };
        with_even_primitives.closest(
            &format!("holes, {order:?}"),
            &gpu.tlas,
            &rays,
            How::default(),
            answer,
        )?;
    }
    Ok(())
}

#[test]
fn aabbs_in_another_order_keep_their_numbers() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let spheres = SphereModel { count: 48, step: 29 };
    let (_buffers, geometries) = spheres.aabb_geometries(&ctx)?;
    let order = PrimitiveOrder::Spatial;
    let model = [ctx.create_blas(&BlasDesc { geometries: &geometries, order, ..Default::default() })?];
    assert_eq!(ctx.accel_struct_info(*model[0])?.is_remapped, builds_device_accel_structs(&ctx));
    let placed = [Placed::new(0, Affine3A::from_rotation_y(0.4))];
    let tlas = ctx.create_tlas(&TlasDesc { instances: &instances(&placed, &model), ..Default::default() })?;
    let rays = random_rays(52, 1_200, Vec3::new(-2.0, -1.0, -3.0), Vec3::new(6.0, 31.0, 4.0));
    spheres.check_hits(&ctx, &tlas, &placed, &rays, "boxes in order", |records| {
        let (radius, tag) = GROUPS[0];
        let hits = records.iter().filter(|record| record.kind != MISSED);
        assert!(hits.into_iter().all(|hit| (hit.kind, hit.barycentrics) == (tag, [radius, tag as f32])));
    })?;
    Ok(())
}

/// A primitive map costs memory and a look-up at every hit, so a mesh that gains nothing has none.
#[test]
fn meshes_are_left_alone_where_order_gains_nothing() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let (good, bad) = (well_ordered(&Mesh::terrain(16)), shuffled(&Mesh::terrain(16)));
    let small = shuffled(&Mesh::cube_grid(1));
    for (mesh, flags, order, remapped) in [
        (&bad, BuildFlags::FAST_TRACE, PrimitiveOrder::Spatial, true),
        (&bad, BuildFlags::FAST_BUILD, PrimitiveOrder::Spatial, true),
        (&bad, BuildFlags::FAST_TRACE, PrimitiveOrder::Given, false),
        (&bad, BuildFlags::FAST_BUILD, PrimitiveOrder::Auto, false),
        (&bad, BuildFlags::empty(), PrimitiveOrder::Auto, false),
        (&good, BuildFlags::FAST_TRACE, PrimitiveOrder::Spatial, false),
        (&good, BuildFlags::FAST_TRACE, PrimitiveOrder::Auto, false),
        (&small, BuildFlags::FAST_TRACE, PrimitiveOrder::Spatial, false),
    ] {
        let info = info_of(&ctx, mesh, flags, order)?;
        let (count, remapped) = (mesh.triangles.len(), remapped && builds_device_accel_structs(&ctx));
        assert_eq!(info.is_remapped, remapped, "{count} triangles, {flags:?}, {order:?}");
        assert_eq!(info.table_bytes > 0, remapped, "{count} triangles, {flags:?}, {order:?}");
    }
    Ok(())
}

/// The order is of the contents at creation; later contents may be anything.
#[test]
fn an_ordered_mesh_is_refitted_and_rebuilt() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let (deformer, check) = (VertexDeformer::new(&ctx)?, HitCheck::new(&ctx)?);
    let mut scene = scene();
    let gpu =
        upload(&ctx, &scene, BuildFlags::FAST_TRACE | BuildFlags::ALLOW_UPDATE, PrimitiveOrder::Spatial)?;
    assert_eq!(ctx.accel_struct_info(*gpu.models[0])?.is_remapped, builds_device_accel_structs(&ctx));
    for (amount, mode) in [(0.3, BuildMode::Refit), (-0.4, BuildMode::Rebuild), (0.2, BuildMode::Refit)] {
        let mesh = scene.models[0][0].mesh.clone();
        let mut cmd = ctx.acquire_command_buffer()?;
        deformer.record(&mut cmd, *gpu.buffers[0].vertices, &mesh, amount)?;
        cmd.build_blas(&[*gpu.models[0]], mode)?;
        cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), mode)?;
        ctx.submit(cmd)?;
        scene.models[0][0].mesh = deformed(&mesh, amount);
        check.scene(&format!("{mode:?} by {amount}"), &gpu.tlas, &scene)?;
    }
    scene.models[0][0].mesh.triangles.reverse();
    let indices: Vec<u16> =
        scene.models[0][0].mesh.triangles.as_flattened().iter().map(|index| *index as u16).collect();
    if let Some(buffer) = &gpu.buffers[0].indices {
        ctx.upload_buffer(**buffer, 0, bytemuck::cast_slice(&indices))?;
    }
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.build_blas(&[*gpu.models[0]], BuildMode::Rebuild)?;
    ctx.submit(cmd)?;
    check.scene("other indices", &gpu.tlas, &scene)
}

/// One acceleration structure with a map beside one without, and then none with a map: the way back to the numbers is the TLAS's.
#[test]
fn a_tlas_references_ordered_and_unordered_meshes_in_turn() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    let scene = scene();
    let ordered = upload(&ctx, &scene, BuildFlags::FAST_TRACE, PrimitiveOrder::Spatial)?;
    let given = upload(&ctx, &scene, BuildFlags::FAST_TRACE, PrimitiveOrder::Given)?;
    let (first, second) =
        (instances(&scene.placed, &ordered.models), instances(&scene.placed, &given.models));
    let mixed = [first[0], second[1], first[2]];
    for (what, shown) in
        [("given", &second[..]), ("mixed", &mixed), ("ordered", &first), ("given again", &second)]
    {
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.update_tlas(*given.tlas, shown, BuildMode::Rebuild)?;
        ctx.submit(cmd)?;
        check.scene(what, &given.tlas, &scene)?;
    }
    Ok(())
}
