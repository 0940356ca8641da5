//! Memory and slots after failed calls and destroyed acceleration structures: nothing is left.

use lvk::{
    AccelStructHandle, BlasDesc, BufferDesc, BuildFlags, BuildMode, DeviceInstances, DeviceProfile, Holder,
    Result, TlasDesc, TlasInstance,
};
use lvk_tests::hit_check::HitCheck;
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{Layout, Part, PartBuffers, RayScene, upload_geometries};
use lvk_tests::{TestDevice, device, device_with};

/// A device that splits meshes of more than 60 triangles, with so much memory for acceleration structures.
fn split_device(accel_budget_bytes: u64) -> Option<TestDevice> {
    let profile = DeviceProfile {
        name: "small structures".into(),
        max_blas_primitives: 60,
        ..DeviceProfile::default()
    };
    device_with(|desc| {
        desc.profile = Some(&profile);
        desc.accel_budget_bytes = accel_budget_bytes;
    })
}

fn model(
    ctx: &TestDevice,
    mesh: Mesh,
    flags: BuildFlags,
) -> Result<(Vec<PartBuffers>, Holder<AccelStructHandle>)> {
    let (buffers, geometries) = upload_geometries(ctx, &[Part::new(mesh, Layout::Indexed16)])?;
    let blas = ctx.create_blas(&BlasDesc { geometries: &geometries, flags, ..Default::default() })?;
    Ok((buffers, blas))
}

#[test]
fn a_slot_of_split_meshes_is_clean_for_the_next_accel_struct() -> Result<()> {
    let Some(ctx) = split_device(u64::MAX) else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    let split = RayScene::single(Mesh::torus(14), Layout::Indexed16);
    let plain = RayScene::single(Mesh::cube_grid(1), Layout::Unshared);
    let first = split.upload(&ctx)?;
    check.scene("split", &first.tlas, &split)?;
    let slot = first.tlas.index();
    drop(first);
    ctx.wait_idle()?;
    let second = plain.upload(&ctx)?;
    assert_eq!(second.tlas.index(), slot, "the slot is used again");
    check.scene("plain", &second.tlas, &plain)?;
    Ok(())
}

#[test]
fn a_batch_that_runs_out_of_memory_half_way_leaves_nothing() -> Result<()> {
    let Some(ctx) = split_device(100_000) else { return Ok(()) };
    let before = ctx.accel_memory().structure_bytes;
    let (_buffers, geometries) = upload_geometries(&ctx, &[Part::new(Mesh::torus(40), Layout::Indexed16)])?;
    let desc = BlasDesc { geometries: &geometries, debug_name: "too large", ..Default::default() };
    let error = ctx.create_blas(&desc).expect_err("its parts take more than the budget");
    assert!(error.to_string().contains("too large"), "{error}");
    ctx.wait_idle()?;
    assert_eq!(ctx.accel_memory().structure_bytes, before);
    Ok(())
}

#[test]
fn a_refused_update_from_a_buffer_leaves_the_command_buffer_usable() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let flags = BuildFlags::FAST_TRACE | BuildFlags::ALLOW_COMPACTION;
    let (_buffers, blas) = model(&ctx, Mesh::cube_grid(1), flags)?;
    let instances = [TlasInstance::new(*blas)];
    let tlas = ctx.create_tlas(&TlasDesc { instances: &instances, ..Default::default() })?;
    let records = ctx.create_buffer(&BufferDesc { size_bytes: 64, ..Default::default() })?;
    ctx.wait_idle()?;
    let mut cmd = ctx.acquire_command_buffer()?;
    let from = DeviceInstances { buffer: *records, offset: 0, count: 1, blas: &[*blas] };
    let error = cmd.update_tlas_from_buffer(*tlas, &from, BuildMode::Refit).expect_err("no ALLOW_UPDATE");
    assert!(error.to_string().contains("ALLOW_UPDATE"), "{error}");
    ctx.wait(ctx.submit(cmd)?)
}

/// Lists that are kept until acceleration structures are compacted lie in buffers that are used again.
#[test]
fn frames_of_accel_structs_that_may_be_compacted_go_on() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    let scene = RayScene::single(Mesh::torus(14), Layout::Indexed16);
    let flags = BuildFlags::FAST_TRACE | BuildFlags::ALLOW_COMPACTION;
    let on_gpu = scene.upload_with(&ctx, flags, BuildFlags::default(), 0)?;
    let instances = lvk_tests::ray_scene::instances(&scene.placed, &on_gpu.models);
    for frame in 0..12 {
        ctx.next_frame()?;
        if frame == 8 {
            ctx.compact(&[*on_gpu.models[0]])?;
        }
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.update_tlas(*on_gpu.tlas, &instances, BuildMode::Rebuild)?;
        ctx.submit(cmd)?;
    }
    check.scene("after twelve frames", &on_gpu.tlas, &scene)?;
    Ok(())
}
