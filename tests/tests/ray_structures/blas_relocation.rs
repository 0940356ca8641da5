//! Rebuilds that move the software BVH of a BLAS that the CPU built: later refits use the new memory. On a device that
//! traces in hardware, the same commands give the same hits.

use lvk::{BlasDesc, BuildFlags, BuildMode, Context, Error, RayQueryRequest, Result, TlasDesc, TlasInstance};
use lvk_tests::accel_backend::builds_software_bvhs;
use lvk_tests::hit_check::HitCheck;
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{Layout, PartBuffers, RayScene, upload_geometries, vertex_bytes};
use lvk_tests::vertex_deform::deformed;
use lvk_tests::{device, device_with};

const UPDATABLE: BuildFlags = BuildFlags::FAST_TRACE.union(BuildFlags::ALLOW_UPDATE);

/// A scene so small that the structure of a GPU build does not fit in the memory of the CPU's tree.
fn ring() -> RayScene {
    RayScene::single(Mesh::torus(4), Layout::Indexed16)
}

/// Bends the mesh, on the GPU too.
fn bend(ctx: &Context, scene: &mut RayScene, buffers: &[PartBuffers], amount: f32) -> Result<()> {
    let part = &mut scene.models[0][0];
    part.mesh = deformed(&part.mesh, amount);
    ctx.upload_buffer(*buffers[0].vertices, 0, &vertex_bytes(&part.mesh, Layout::Indexed16))
}

#[test]
fn a_loaded_accel_struct_is_refitted_where_it_was_rebuilt() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let mut scene = ring();
    let gpu = scene.upload_with(&ctx, UPDATABLE, UPDATABLE, 0)?;
    ctx.wait_idle()?;
    let bytes = ctx.serialize_blas(*gpu.models[0])?;
    let (buffers, geometries) = upload_geometries(&ctx, &scene.models[0])?;
    // SAFETY: the library wrote the bytes just now.
    let loaded = unsafe {
        ctx.load_blas(&BlasDesc { geometries: &geometries, flags: UPDATABLE, ..Default::default() }, &bytes)
    }?;
    let shown = [TlasInstance::new(*loaded)];
    let tlas = ctx.create_tlas(&TlasDesc { instances: &shown, flags: UPDATABLE, ..Default::default() })?;
    let check = HitCheck::new(&ctx)?;
    for (amount, mode) in [(0.3, BuildMode::Rebuild), (-0.5, BuildMode::Refit), (0.4, BuildMode::Refit)] {
        bend(&ctx, &mut scene, &buffers, amount)?;
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.build_blas(&[*loaded], mode)?;
        cmd.update_tlas(*tlas, &shown, mode)?;
        ctx.submit(cmd)?;
        check.scene(&format!("loaded, then {mode:?} and deformed by {amount}"), &tlas, &scene)?;
    }
    Ok(())
}

/// Two command buffers are recorded side by side: the second refits a tree that the first has moved by then.
#[test]
fn a_refit_overtaken_by_the_first_rebuild_is_refused_by_software() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let mut scene = ring();
    let gpu = scene.upload_with(&ctx, UPDATABLE, UPDATABLE, 0)?;
    ctx.wait_idle()?;
    bend(&ctx, &mut scene, &gpu.buffers, 0.4)?;
    let shown = [TlasInstance::new(*gpu.models[0])];
    let record = |mode| {
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.build_blas(&[*gpu.models[0]], mode)?;
        cmd.update_tlas(*gpu.tlas, &shown, BuildMode::Rebuild)?;
        Ok(cmd)
    };
    let (rebuild, late): (_, Result<_>) = (record(BuildMode::Rebuild)?, record(BuildMode::Refit));
    ctx.submit(rebuild)?;
    bend(&ctx, &mut scene, &gpu.buffers, -0.3)?;
    let refused = ctx.submit(late?);
    if builds_software_bvhs(&ctx) {
        let Err(Error::InvalidUsage { message, .. }) = refused else { unreachable!("{refused:?}") };
        assert!(message.contains("record it anew"), "{message}");
        ctx.submit(record(BuildMode::Refit)?)?;
    } else {
        refused?;
    }
    HitCheck::new(&ctx)?.scene("refitted after all", &gpu.tlas, &scene)
}

/// The CPU builds a TLAS from where it knows its acceleration structures to lie, which a rebuild may change.
#[test]
fn an_update_overtaken_by_the_first_rebuild_is_refused_by_software() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let mut scene = ring();
    let gpu = scene.upload_with(&ctx, BuildFlags::FAST_TRACE, BuildFlags::FAST_TRACE, 0)?;
    ctx.wait_idle()?;
    bend(&ctx, &mut scene, &gpu.buffers, 0.4)?;
    let shown = [TlasInstance::new(*gpu.models[0])];
    let update = || {
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.update_tlas(*gpu.tlas, &shown, BuildMode::Rebuild)?;
        Ok(cmd)
    };
    let (before, late): (_, Result<_>) = (update()?, update());
    ctx.submit(before)?;
    let mut rebuild = ctx.acquire_command_buffer()?;
    rebuild.build_blas(&[*gpu.models[0]], BuildMode::Rebuild)?;
    ctx.submit(rebuild)?;
    let refused = ctx.submit(late?);
    if builds_software_bvhs(&ctx) {
        let Err(Error::InvalidUsage { message, .. }) = refused else { unreachable!("{refused:?}") };
        assert!(message.contains("record the update anew"), "{message}");
        ctx.submit(update()?)?;
    } else {
        refused?;
    }
    HitCheck::new(&ctx)?.scene("rebuilt, then shown anew", &gpu.tlas, &scene)
}

/// Room for the tree is made before anything is recorded, of the device's own acceleration structures too.
#[test]
fn a_rebuild_out_of_memory_leaves_what_is_recorded_around_it() -> Result<()> {
    let of_budget = |bytes| {
        device_with(|desc| (desc.ray_query, desc.accel_budget_bytes) = (RayQueryRequest::Software, bytes))
    };
    let mut scene = ring();
    let needed = {
        let Some(ctx) = of_budget(u64::MAX) else { return Ok(()) };
        let _gpu = scene.upload_with(&ctx, UPDATABLE, UPDATABLE, 0)?;
        ctx.wait_idle()?;
        ctx.accel_memory().structure_bytes
    };
    let Some(ctx) = of_budget(needed) else { return Ok(()) };
    let gpu = scene.upload_with(&ctx, UPDATABLE, UPDATABLE, 0)?;
    ctx.wait_idle()?;
    bend(&ctx, &mut scene, &gpu.buffers, 0.4)?;
    let mut cmd = ctx.acquire_command_buffer()?;
    let refused = cmd.build_blas(&[*gpu.models[0]], BuildMode::Rebuild);
    assert!(matches!(refused, Err(Error::OverBudget { budget, .. }) if budget == needed), "{refused:?}");
    cmd.build_blas(&[*gpu.models[0]], BuildMode::Refit)?;
    cmd.update_tlas(*gpu.tlas, &[TlasInstance::new(*gpu.models[0])], BuildMode::Rebuild)?;
    ctx.submit(cmd)?;
    ctx.wait_idle()?;
    assert_eq!(ctx.accel_memory().structure_bytes, needed);
    HitCheck::new(&ctx)?.scene("refitted in place of rebuilt", &gpu.tlas, &scene)
}
