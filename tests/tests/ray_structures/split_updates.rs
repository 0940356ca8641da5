//! Updates of split meshes: refits, rebuilds, compaction, instances written by the GPU. No test records a barrier.

use bytemuck::NoUninit;
use lvk::glam::{Affine3A, Quat, Vec3};
use lvk::{
    AccelStructHandle, BlasDesc, BufferDesc, BufferUsage, BuildFlags, BuildMode, Compaction, Context,
    Dependencies, DeviceInstances, DeviceProfile, Error, Result, TlasDesc,
};
use lvk_tests::accel_backend::{builds_device_accel_structs, expect_parts, requires_device_accel_structs};
use lvk_tests::compute::compute_pipeline;
use lvk_tests::hit_check::{HitCheck, rays_for};
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{Layout, Part, Placed, RayScene, instances, upload_geometries};
use lvk_tests::ray_tracer::How;
use lvk_tests::vertex_deform::{VertexDeformer, deformed};
use lvk_tests::{TestDevice, device_with};

const UPDATABLE: BuildFlags = BuildFlags::FAST_TRACE.union(BuildFlags::ALLOW_UPDATE);

/// A device that takes 40 primitives in an acceleration structure.
fn split_device() -> Option<TestDevice> {
    let profile = DeviceProfile {
        name: "small structures".into(),
        max_blas_primitives: 40,
        ..DeviceProfile::default()
    };
    device_with(|desc| desc.profile = Some(&profile))
}

#[track_caller]
fn expect_split(ctx: &Context, handle: AccelStructHandle) -> Result<u32> {
    expect_parts(ctx, handle, 5..=40)
}

/// Two instances of a ring, which is split, and a cube, which is not.
fn scene() -> RayScene {
    let model = |mesh| vec![Part::new(mesh, Layout::Indexed32)];
    let at =
        |x: f32, y: f32| Affine3A::from_rotation_translation(Quat::from_rotation_z(x), Vec3::new(x, y, 0.0));
    let place =
        |(index, model, transform)| Placed { custom_index: 70 + index, ..Placed::new(model, transform) };
    let placed = [(0_u32, 0, at(0.0, 0.0)), (1, 1, at(0.5, 2.5)), (2, 0, at(3.2, 0.4))];
    RayScene {
        models: vec![model(Mesh::torus(10)), model(Mesh::cube_grid(1))],
        placed: placed.map(place).to_vec(),
    }
}

/// The compute shader, the refit and the trace are in one command buffer.
#[test]
fn a_refit_follows_vertices_written_by_a_dispatch() -> Result<()> {
    let Some(ctx) = split_device() else { return Ok(()) };
    let (deformer, check) = (VertexDeformer::new(&ctx)?, HitCheck::new(&ctx)?);
    for (method, tracer) in check.tracers() {
        let mut scene = scene();
        let gpu = scene.upload_with(&ctx, UPDATABLE, UPDATABLE, 0)?;
        expect_split(&ctx, *gpu.models[0])?;
        for (amount, mode) in [
            (0.3, BuildMode::Refit),
            (-0.5, BuildMode::Refit),
            (0.4, BuildMode::Rebuild),
            (0.2, BuildMode::Refit),
        ] {
            let mesh = scene.models[0][0].mesh.clone();
            scene.models[0][0].mesh = deformed(&mesh, amount);
            let reference = scene.reference();
            let rays = rays_for(&reference);
            let trace_buffers = tracer.buffers(&rays)?;
            let mut cmd = ctx.acquire_command_buffer()?;
            deformer.record(&mut cmd, *gpu.buffers[0].vertices, &mesh, amount)?;
            cmd.build_blas(&[*gpu.models[0]], mode)?;
            cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), mode)?;
            tracer.record(&mut cmd, &gpu.tlas, &trace_buffers, How::default())?;
            ctx.submit(cmd)?;
            lvk_tests::hit_comparison::HitComparison::of_triangles(
                &rays,
                &tracer.read(&trace_buffers)?,
                |ray| reference.closest(ray, 0xff),
            )
            .assert(&format!("{mode:?} after {amount}, {method:?}"));
        }
    }
    Ok(())
}

/// Triangles of a part are looked up again: other indices are other triangles, wherever they lie.
#[test]
fn a_rebuild_follows_other_indices() -> Result<()> {
    let Some(ctx) = split_device() else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    for layout in [Layout::Indexed32, Layout::Indexed16] {
        let mut scene = scene();
        scene.models[0][0].layout = layout;
        let gpu = scene.upload(&ctx)?;
        expect_split(&ctx, *gpu.models[0])?;
        check.scene("before", &gpu.tlas, &scene)?;
        scene.models[0][0].mesh.triangles.rotate_left(57);
        let indices = scene.models[0][0].mesh.triangles.as_flattened();
        let short: Vec<u16> = indices.iter().map(|index| *index as u16).collect();
        let bytes = if layout == Layout::Indexed16 {
            bytemuck::cast_slice(&short)
        } else {
            bytemuck::cast_slice(indices)
        };
        let buffer = gpu.buffers[0].indices.as_ref();
        ctx.upload_buffer(**buffer.ok_or(Error::StaleHandle { kind: "buffer", name: None })?, 0, bytes)?;
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.build_blas(&[*gpu.models[0]], BuildMode::Rebuild)?;
        cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), BuildMode::Rebuild)?;
        ctx.submit(cmd)?;
        check.scene(&format!("other indices, {layout:?}"), &gpu.tlas, &scene)?;
    }
    Ok(())
}

#[test]
fn auto_builds_follow_frame_by_frame() -> Result<()> {
    const AUTO: BuildMode = BuildMode::Auto { max_refits: 2 };
    let Some(ctx) = split_device() else { return Ok(()) };
    let (deformer, check) = (VertexDeformer::new(&ctx)?, HitCheck::new(&ctx)?);
    for flags in [UPDATABLE, BuildFlags::FAST_BUILD] {
        let mut scene = scene();
        let gpu = scene.upload_with(&ctx, flags, flags, 0)?;
        expect_split(&ctx, *gpu.models[0])?;
        for frame in 0..5 {
            ctx.next_frame()?;
            let mesh = scene.models[0][0].mesh.clone();
            let mut cmd = ctx.acquire_command_buffer()?;
            deformer.record(&mut cmd, *gpu.buffers[0].vertices, &mesh, 0.1)?;
            cmd.build_blas(&[*gpu.models[0], *gpu.models[1]], AUTO)?;
            scene.models[0][0].mesh = deformed(&mesh, 0.1);
            // Another number of instances, of parts too, makes a rebuild of its own accord.
            scene.placed.truncate(if frame < 3 { 3 } else { 2 });
            cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), AUTO)?;
            ctx.submit(cmd)?;
            check.scene(&format!("frame {frame}, {flags:?}"), &gpu.tlas, &scene)?;
        }
    }
    Ok(())
}

#[test]
fn refits_that_are_not_allowed_are_refused() -> Result<()> {
    let Some(ctx) = split_device() else { return Ok(()) };
    let mut scene = scene();
    let gpu = scene.upload_with(&ctx, BuildFlags::default(), UPDATABLE, 8)?;
    let mut cmd = ctx.acquire_command_buffer()?;
    let refused = cmd.build_blas(&[*gpu.models[0]], BuildMode::Refit);
    assert!(matches!(&refused, Err(Error::InvalidUsage { object, .. }) if object == "model"), "{refused:?}");
    // As many instances, but of fewer parts.
    let mut placed = scene.placed.clone();
    placed[0].model = 1;
    let refitted = cmd.update_tlas(*gpu.tlas, &instances(&placed, &gpu.models), BuildMode::Refit);
    if builds_device_accel_structs(&ctx) {
        assert!(
            matches!(&refitted, Err(Error::InvalidUsage { object, .. }) if object == "tlas"),
            "{refitted:?}"
        );
    } else {
        // Every acceleration structure is one part.
        refitted?;
        scene.placed = placed;
    }
    ctx.submit(cmd)?;
    HitCheck::new(&ctx)?.scene("after refusals", &gpu.tlas, &scene)
}

#[test]
fn a_compacted_split_mesh_is_hit_and_refitted_like_before() -> Result<()> {
    let Some(ctx) = split_device() else { return Ok(()) };
    let (deformer, check) = (VertexDeformer::new(&ctx)?, HitCheck::new(&ctx)?);
    let mut scene = scene();
    let gpu = scene.upload_with(&ctx, UPDATABLE | BuildFlags::ALLOW_COMPACTION, UPDATABLE, 0)?;
    let parts = expect_split(&ctx, *gpu.models[0])?;
    ctx.compact(&[*gpu.models[0], *gpu.models[1]])?;
    ctx.wait_idle()?;
    ctx.flush()?;
    check.scene("compacted", &gpu.tlas, &scene)?;
    let info = ctx.accel_struct_info(*gpu.models[0])?;
    let Compaction::Done { before_bytes, after_bytes } = info.compaction else { unreachable!("{info:?}") };
    assert!(
        after_bytes <= before_bytes && after_bytes == info.structure_bytes && info.parts == parts,
        "{info:?}"
    );
    for amount in [0.3, -0.2] {
        let mesh = scene.models[0][0].mesh.clone();
        let mut cmd = ctx.acquire_command_buffer()?;
        deformer.record(&mut cmd, *gpu.buffers[0].vertices, &mesh, amount)?;
        cmd.build_blas(&[*gpu.models[0]], BuildMode::Refit)?;
        cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), BuildMode::Refit)?;
        ctx.submit(cmd)?;
        scene.models[0][0].mesh = deformed(&mesh, amount);
        check.scene(&format!("compacted and deformed by {amount}"), &gpu.tlas, &scene)?;
    }
    Ok(())
}

#[test]
fn refitted_instances_of_split_meshes_move_with_all_their_parts() -> Result<()> {
    let Some(ctx) = split_device() else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    let mut scene = scene();
    let gpu = scene.upload_with(&ctx, BuildFlags::default(), UPDATABLE, 0)?;
    expect_split(&ctx, *gpu.models[0])?;
    for turn in [0.4, 2.1] {
        for placed in &mut scene.placed {
            placed.transform = Affine3A::from_rotation_x(turn) * placed.transform;
            placed.custom_index += 1;
        }
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), BuildMode::Refit)?;
        ctx.submit(cmd)?;
        check.scene(&format!("turned by {turn}"), &gpu.tlas, &scene)?;
    }
    Ok(())
}

/// Instances in two columns, every third of an acceleration structure that does not exist.
const WRITE_INSTANCES: &str = "
    layout(local_size_x = 32) in;
    struct Instance { vec4 rows[3]; uint customAndMask; uint offsetAndFlags; uvec2 place; };
    layout(buffer_reference, scalar, buffer_reference_align = 16) buffer Instances { Instance at[]; };
    layout(push_constant, scalar) uniform Push { Instances instances; uint count; float shift; };
    void main() {
        uint i = gl_GlobalInvocationID.x;
        if (i >= count) return;
        vec3 to = vec3(float(i % 2) * 3.0 + shift, float(i / 2) * 2.5, shift);
        vec4 rows[3] = vec4[](vec4(1, 0, 0, to.x), vec4(0, 1, 0, to.y), vec4(0, 0, 1, to.z));
        uint place = i % 3 == 2 ? 77 : i % 3;
        instances.at[i] = Instance(rows, (300 + i) | 0xff000000u, 0, uvec2(place, 0));
    }";

#[repr(C)]
#[derive(Clone, Copy, NoUninit)]
struct WritePush {
    instances: u64,
    count: u32,
    shift: f32,
}

/// Returns the scene that [`WRITE_INSTANCES`] writes. Empty instances are of a model without triangles.
fn written(count: u32, shift: f32) -> RayScene {
    let nothing = Mesh { positions: Vec::new(), triangles: Vec::new() };
    let mut models = scene().models;
    models.push(vec![Part::new(nothing, Layout::Unshared)]);
    let place = |i: u32| {
        let to = Vec3::new((i % 2) as f32 * 3.0 + shift, (i / 2) as f32 * 2.5, shift);
        Placed { custom_index: 300 + i, ..Placed::new(i as usize % 3, Affine3A::from_translation(to)) }
    };
    RayScene { models, placed: (0..count).map(place).collect() }
}

#[test]
fn instances_written_by_the_gpu_may_reference_split_meshes() -> Result<()> {
    const COUNT: u32 = 7;
    let Some(ctx) = split_device() else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    let writer = compute_pipeline(&ctx, WRITE_INSTANCES);
    for flags in [BuildFlags::default(), BuildFlags::FAST_TRACE | BuildFlags::ALLOW_COMPACTION] {
        let models = scene().upload_with(&ctx, flags, BuildFlags::default(), 0)?.models;
        let parts = expect_split(&ctx, *models[0])?;
        let desc =
            TlasDesc { capacity: COUNT, parts_per_instance: parts, flags: UPDATABLE, ..Default::default() };
        let tlas = ctx.create_tlas(&desc)?;
        let size_bytes = u64::from(COUNT) * 64 + 32;
        let desc = BufferDesc { size_bytes, usage: BufferUsage::STORAGE, ..Default::default() };
        let buffer = ctx.create_buffer(&desc)?;
        for (shift, mode) in [(0.0, BuildMode::Rebuild), (0.7, BuildMode::Refit)] {
            let blas = [*models[0], *models[1]];
            let source = DeviceInstances { buffer: *buffer, offset: 32, count: COUNT, blas: &blas };
            let mut cmd = ctx.acquire_command_buffer()?;
            cmd.bind_compute_pipeline(*writer)?;
            let instances = ctx.buffer_address(*buffer)? + 32;
            cmd.push_constants(&WritePush { instances, count: COUNT, shift })?;
            cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*buffer], ..Default::default() })?;
            cmd.update_tlas_from_buffer(*tlas, &source, mode)?;
            ctx.submit(cmd)?;
            check.scene(&format!("{mode:?} of written instances"), &tlas, &written(COUNT, shift))?;
        }
        if flags.contains(BuildFlags::ALLOW_COMPACTION) {
            ctx.compact(&[*models[0], *models[1]])?;
            ctx.upload_buffer(*buffer, 0, &vec![0xff; size_bytes as usize])?;
            ctx.wait_idle()?;
            ctx.flush()?;
            let compaction = ctx.accel_struct_info(*models[0])?.compaction;
            assert!(matches!(compaction, Compaction::Done { .. }), "{compaction:?}");
            check.scene("compacted, the buffer overwritten", &tlas, &written(COUNT, 0.7))?;
        }
    }
    Ok(())
}

/// Room for parts is asked for when the acceleration structure is made.
#[test]
fn more_parts_than_the_capacity_are_refused() -> Result<()> {
    let Some(ctx) = split_device() else { return Ok(()) };
    let scene = scene();
    let gpu = scene.upload(&ctx)?;
    let parts = expect_split(&ctx, *gpu.models[0])?;
    let shown = instances(&scene.placed, &gpu.models);
    let room = |parts_per_instance| TlasDesc {
        capacity: 3,
        parts_per_instance,
        debug_name: "tight",
        ..Default::default()
    };
    let tight = ctx.create_tlas(&room(1))?;
    let usage = BufferUsage::STORAGE;
    let buffer = ctx.create_buffer(&BufferDesc { size_bytes: 192, usage, ..Default::default() })?;
    let blas = [*gpu.models[0]];
    let source = DeviceInstances { buffer: *buffer, offset: 0, count: 3, blas: &blas };
    let mut cmd = ctx.acquire_command_buffer()?;
    let updates = [
        cmd.update_tlas(*tight, &shown, BuildMode::Rebuild),
        cmd.update_tlas_from_buffer(*tight, &source, BuildMode::Rebuild),
    ];
    for updated in updates {
        if !builds_device_accel_structs(&ctx) {
            // Of one part each there is room for all.
            updated?;
            continue;
        }
        let Err(Error::InvalidUsage { object, message }) = updated else { unreachable!("{updated:?}") };
        assert!(object == "tight" && message.contains("parts_per_instance"), "{object}: {message}");
    }
    cmd.update_tlas(*tight, &shown[1..2], BuildMode::Rebuild)?;
    let wide = ctx.create_tlas(&room(parts))?;
    cmd.update_tlas(*wide, &shown, BuildMode::Rebuild)?;
    ctx.submit(cmd)?;
    HitCheck::new(&ctx)?.scene("room for all parts", &wide, &scene)
}

/// Typed, with nothing of the batch left behind, and the context goes on.
#[test]
fn a_triangle_that_does_not_fit_is_an_error() -> Result<()> {
    let any = || DeviceProfile { name: "too small".into(), ..DeviceProfile::default() };
    for profile in [
        DeviceProfile { max_blas_primitives: 0, ..any() },
        DeviceProfile { max_accel_structure_bytes: 64, ..any() },
        DeviceProfile { scratch_bytes_per_primitive: 1 << 20, max_accel_scratch_bytes: 1 << 20, ..any() },
    ] {
        let Some(ctx) = device_with(|desc| desc.profile = Some(&profile)) else { return Ok(()) };
        let scene = scene();
        ctx.wait_idle()?;
        let before = ctx.accel_memory();
        let (_buffers, geometries) = lvk_tests::ray_scene::upload_geometries(&ctx, &scene.models[1])?;
        let desc = |geometries| BlasDesc { geometries, debug_name: "huge", ..Default::default() };
        let made = ctx.create_blas_batch(&[desc(&geometries), desc(&geometries)]);
        if !builds_device_accel_structs(&ctx) {
            // The limits of a profile are those of the device's acceleration structures.
            assert_eq!(made?.len(), 2);
            continue;
        }
        let Err(Error::LimitExceeded { object, what, requested, limit, .. }) = &made else {
            unreachable!("{:?}", made.map(|made| made.len()))
        };
        assert!(object == "huge" && requested > limit, "{object}: {what} {requested} {limit}");
        ctx.wait_idle()?;
        assert_eq!(ctx.accel_memory(), before);
    }
    Ok(())
}

/// Indices gathered for the parts are of no use once nothing can build them again.
#[test]
fn compaction_frees_what_only_builds_read() -> Result<()> {
    let Some(ctx) =
        split_device().filter(|ctx| requires_device_accel_structs(ctx, "inputs that are gathered for parts"))
    else {
        return Ok(());
    };
    let (scene, check) = (scene(), HitCheck::new(&ctx)?);
    for (flags, freed) in [(BuildFlags::FAST_TRACE, true), (UPDATABLE, false)] {
        let gpu = scene.upload_with(&ctx, flags | BuildFlags::ALLOW_COMPACTION, UPDATABLE, 0)?;
        let (ring, triangles) = (*gpu.models[0], scene.models[0][0].mesh.triangles.len() as u64);
        let before = ctx.accel_struct_info(ring)?.table_bytes;
        ctx.compact(&[ring])?;
        (0..3).try_for_each(|_| ctx.wait_idle())?;
        let info = ctx.accel_struct_info(ring)?;
        assert!(matches!(info.compaction, Compaction::Done { .. }), "{info:?}");
        assert_eq!(before - info.table_bytes, if freed { triangles * 12 } else { 0 });
        check.scene("compacted", &gpu.tlas, &scene)?;
        let mut cmd = ctx.acquire_command_buffer()?;
        assert!(matches!(cmd.build_blas(&[ring], BuildMode::Rebuild), Err(Error::InvalidUsage { .. })));
        let refit = cmd.build_blas(&[ring], BuildMode::Refit);
        assert_eq!(refit.is_err(), freed, "{refit:?}");
        ctx.wait(ctx.submit(cmd)?)?;
        check.scene("refitted or not", &gpu.tlas, &scene)?;
        let bytes = ctx.serialize_blas(ring)?;
        let (_buffers, geometries) = upload_geometries(&ctx, &scene.models[0])?;
        let desc = BlasDesc {
            geometries: &geometries,
            flags: flags | BuildFlags::ALLOW_COMPACTION,
            ..Default::default()
        };
        // SAFETY: the library wrote the bytes just now.
        let loaded = unsafe { ctx.load_blas(&desc, &bytes) }?;
        ctx.wait_idle()?;
        let mut cmd = ctx.acquire_command_buffer()?;
        let rebuilt = cmd.build_blas(&[*loaded], BuildMode::Rebuild).is_ok();
        ctx.submit(cmd)?;
        // A loaded acceleration structure for which compaction saved nothing has room for a build.
        let needed = if rebuilt { before } else { info.table_bytes };
        assert_eq!(ctx.accel_struct_info(*loaded)?.table_bytes, needed);
        let models = [loaded];
        let single = RayScene {
            placed: vec![Placed::new(0, Affine3A::IDENTITY)],
            ..RayScene::single(scene.models[0][0].mesh.clone(), Layout::Indexed32)
        };
        let shown = instances(&single.placed, &models);
        let tlas = ctx.create_tlas(&TlasDesc { instances: &shown, ..Default::default() })?;
        check.scene("loaded", &tlas, &single)?;
    }
    Ok(())
}
