//! Vertices of the hit triangle, fetched from the acceleration structure: those of the mesh, in its own order and in
//! object space.

use lvk::glam::{Affine3A, Quat, Vec3};
use lvk::{
    BlasDesc, BuildFlags, BuildMode, Context, DeviceProfile, Error, GeometryFlags, HitGroup, RayQueryPath,
    RayTracingPipelinePath, Result, ShaderStage, TlasDesc,
};
use lvk_tests::hit_check::rays_for;
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{GpuScene, Layout, Part, Placed, RayScene, instances, vertex_bytes};
use lvk_tests::ray_tracer::{HitRecord, How, MISSED, Method, RayTracer, shader, shader_with};
use lvk_tests::reference::HitIds;
use lvk_tests::{TestDevice, device, device_with};

const FETCH: BuildFlags = BuildFlags::FAST_TRACE.union(BuildFlags::POSITION_FETCH);

/// Writes one corner of what was hit into the record, see `corner.rchit.glsl`.
fn tracer(ctx: &Context, method: Method, corner: usize) -> Result<RayTracer> {
    let number = corner.to_string();
    let defines: &[_] = &[("CORNER", number.as_str())];
    if method == Method::Query {
        let text = include_str!("../../shaders/corner_query.comp.glsl");
        return RayTracer::from_query_text(ctx, text, defines);
    }
    let ray_gen = shader(ctx, ShaderStage::RayGen, include_str!("../../shaders/closest.rgen.glsl"))?;
    let miss = shader(ctx, ShaderStage::Miss, include_str!("../../shaders/record.rmiss.glsl"))?;
    let text = include_str!("../../shaders/corner.rchit.glsl");
    let hit = shader_with(ctx, ShaderStage::ClosestHit, text, defines)?;
    let any_hit = shader(ctx, ShaderStage::AnyHit, include_str!("../../shaders/corner.rahit.glsl"))?;
    RayTracer::from_groups(
        ctx,
        *ray_gen,
        *miss,
        &[HitGroup { closest_hit: Some(*hit), any_hit: Some(*any_hit), ..Default::default() }],
    )
}

/// Whole meshes, and such as are cut into many parts; none where the device cannot fetch.
fn devices() -> Vec<TestDevice> {
    let profile = DeviceProfile { max_blas_primitives: 40, ..DeviceProfile::default() };
    let mut devices: Vec<_> =
        device().into_iter().chain(device_with(|desc| desc.profile = Some(&profile))).collect();
    devices.retain(|ctx| {
        let can = ctx.capabilities().position_fetch;
        if !can {
            eprintln!("NOT TESTED, {} fetches no positions", ctx.capabilities().device_name);
        }
        can
    });
    devices
}

fn part(mesh: Mesh, layout: Layout, flags: GeometryFlags) -> Part {
    Part { flags, ..Part::new(mesh, layout) }
}

/// Four models of one geometry each, in all layouts.
fn scene(flags: GeometryFlags) -> RayScene {
    let moved = Affine3A::from_scale_rotation_translation(
        Vec3::new(0.8, -1.0, 1.2),
        Quat::from_rotation_z(0.6),
        Vec3::new(0.5, 1.0, 0.0),
    );
    let models = vec![
        vec![part(Mesh::torus(8), Layout::Indexed16, flags)],
        vec![part(Mesh::cube_grid(2), Layout::Unshared, flags)],
        vec![part(Mesh::sphere(7), Layout::Interleaved, flags)],
        vec![Part { transform: Some(moved), ..part(Mesh::terrain(6), Layout::Indexed32, flags) }],
    ];
    RayScene { models, placed: (0..6).map(instance_at).collect() }
}

fn instance_at(index: u32) -> Placed {
    let turn = Quat::from_rotation_y(index as f32);
    let to = Vec3::new((index % 3) as f32 * 3.0, (index / 3) as f32 * 3.0, 0.3);
    let scale = Vec3::new(1.0, 0.7, if index % 3 == 2 { -1.0 } else { 1.0 });
    Placed::new(index as usize % 4, Affine3A::from_scale_rotation_translation(scale, turn, to))
}

/// The corner of a hit triangle in object space.
fn expected_vertex(scene: &RayScene, ids: &HitIds, corner: usize) -> Vec3 {
    let part = &scene.models[scene.placed[ids.instance as usize].model][ids.geometry as usize];
    let vertex = part.mesh.triangles[ids.primitive as usize][corner];
    let position = Vec3::from(part.mesh.positions[vertex as usize]);
    part.transform.map_or(position, |transform| transform.transform_point3(position))
}

fn check(ctx: &TestDevice, what: &str, gpu: &GpuScene, scene: &RayScene) -> Result<()> {
    let reference = scene.reference();
    let rays = rays_for(&reference);
    let is_kept =
        |ids: &HitIds| (0..3).map(|number| expected_vertex(scene, ids, number).x).sum::<f32>() >= 0.0;
    for method in Method::available(ctx) {
        for number in 0..3 {
            let records = tracer(ctx, method, number)?.trace(&gpu.tlas, &rays, How::default())?;
            let mut hits = 0;
            for (ray, record) in rays.iter().zip(&records) {
                let how = How::default();
                let answer = reference.closest_by_where(ray, how, |hit| hit.is_opaque || is_kept(&hit.ids));
                if answer.is_certain {
                    let expected = answer.hit.map(|hit| (hit.ids, expected_vertex(scene, &hit.ids, number)));
                    hits += usize::from(expected.is_some());
                    assert!(
                        is_same(record, expected),
                        "{what}, {number} by {method:?}: {record:?}, {expected:?}"
                    );
                }
            }
            assert!(hits * 10 > rays.len(), "{what}: {hits} hits");
        }
    }
    Ok(())
}

fn is_same(record: &HitRecord, expected: Option<(HitIds, Vec3)>) -> bool {
    let HitRecord { instance, custom_index, geometry, primitive, .. } = *record;
    let ids = HitIds { instance, custom_index, geometry, primitive };
    let found = Vec3::new(record.t, record.barycentrics[0], record.barycentrics[1]);
    match expected {
        None => record.kind == MISSED,
        Some((hit, corner)) => record.kind != MISSED && ids == hit && found.abs_diff_eq(corner, 1e-5),
    }
}

#[test]
fn fetched_vertices_are_those_of_the_mesh() -> Result<()> {
    for ctx in devices() {
        for flags in [GeometryFlags::OPAQUE, GeometryFlags::empty()] {
            let scene = scene(flags);
            let gpu = scene.upload_with(&ctx, FETCH, BuildFlags::default(), 0)?;
            check(&ctx, &format!("{flags:?}"), &gpu, &scene)?;
        }
    }
    Ok(())
}

/// lavapipe 25.0 answers the corners of the first geometry for all.
#[test]
fn fetched_vertices_of_every_geometry_are_its_own() -> Result<()> {
    for ctx in devices() {
        if ctx.capabilities().device_name.contains("llvmpipe") {
            eprintln!("NOT TESTED, {} knows the first geometry only", ctx.capabilities().device_name);
            continue;
        }
        let parts = scene(GeometryFlags::OPAQUE).models.concat();
        let scene = RayScene { models: vec![parts; 4], placed: (0..2).map(instance_at).collect() };
        let gpu = scene.upload_with(&ctx, FETCH, BuildFlags::default(), 0)?;
        check(&ctx, "several geometries", &gpu, &scene)?;
    }
    Ok(())
}

#[test]
fn fetched_vertices_move_with_a_refit() -> Result<()> {
    for ctx in devices() {
        let mut scene = scene(GeometryFlags::OPAQUE);
        let gpu = scene.upload_with(&ctx, FETCH | BuildFlags::ALLOW_UPDATE, BuildFlags::default(), 0)?;
        for mode in [BuildMode::Refit, BuildMode::Rebuild] {
            let mesh = &mut scene.models[0][0].mesh;
            mesh.positions.iter_mut().for_each(|[x, y, _]| *y += 0.3 * *x);
            ctx.upload_buffer(*gpu.buffers[0].vertices, 0, &vertex_bytes(mesh, Layout::Indexed16))?;
            let mut cmd = ctx.acquire_command_buffer()?;
            cmd.build_blas(&[*gpu.models[0]], mode)?;
            cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), BuildMode::Rebuild)?;
            ctx.submit(cmd)?;
            check(&ctx, &format!("{mode:?}"), &gpu, &scene)?;
        }
    }
    Ok(())
}

#[test]
fn without_the_capability_only_software_can_fetch() -> Result<()> {
    let profile = DeviceProfile { name: "blind".into(), position_fetch: false, ..DeviceProfile::default() };
    let Some(ctx) = device_with(|desc| desc.profile = Some(&profile)) else { return Ok(()) };
    let scene = scene(GeometryFlags::OPAQUE);
    let device = ctx.capabilities();
    // Acceleration structures of the library have positions whatever the device has.
    let is_software = device.ray_query_path == RayQueryPath::Software
        && !matches!(
            device.ray_tracing_pipeline_path,
            RayTracingPipelinePath::Hardware | RayTracingPipelinePath::Query
        );
    assert_eq!(device.position_fetch, is_software);
    if is_software {
        let gpu = scene.upload_with(&ctx, FETCH, BuildFlags::default(), 0)?;
        return check(&ctx, "in software alone", &gpu, &scene);
    }
    let Err(error) = scene.upload_with(&ctx, FETCH, BuildFlags::default(), 0) else {
        unreachable!("positions must not be fetched")
    };
    assert!(matches!(error, Error::Unsupported { .. }), "{error:?}");
    let text = error.to_string();
    assert!(text.contains("POSITION_FETCH, which 'model' has in its flags"), "{text}");
    let flags = BuildFlags::POSITION_FETCH;
    let refused = ctx.create_blas(&BlasDesc { flags, debug_name: "bare", ..Default::default() });
    assert!(
        matches!(&refused, Err(Error::Unsupported { what, .. }) if what.contains("'bare'")),
        "{refused:?}"
    );
    for method in Method::available(&ctx) {
        let Err(error) = tracer(&ctx, method, 0) else { unreachable!("the shader must not compile") };
        assert!(matches!(error, Error::Shader { .. } | Error::Unsupported { .. }), "{error:?}");
    }
    let defined =
        "#ifdef LVK_POSITION_FETCH\n#error there\n#endif\nlayout(local_size_x = 1) in; void main() {}";
    let _compiles = shader(&ctx, ShaderStage::Compute, defined)?;
    let _plain = scene.upload(&ctx)?;
    Ok(())
}

#[test]
fn a_tlas_has_no_vertices_to_fetch() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let outcome = ctx.create_tlas(&TlasDesc { flags: FETCH, ..Default::default() }).map(drop);
    assert!(matches!(outcome, Err(Error::InvalidUsage { .. })), "{outcome:?}");
    Ok(())
}
