//! Several updates of one TLAS: in one command buffer, and in command buffers that are submitted in another order.

use lvk::glam::{Affine3A, Vec3};
use lvk::{BuildFlags, BuildMode, DeviceProfile, Result, TlasDesc};
use lvk_tests::hit_check::HitCheck;
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{Layout, Part, Placed, RayScene, instances};
use lvk_tests::{device, device_with};

const UPDATABLE: BuildFlags = BuildFlags::FAST_TRACE.union(BuildFlags::ALLOW_UPDATE);

/// Returns `count` instances of one of two meshes in a row.
fn instances_in_a_row(count: u32, model: usize, shift: f32) -> RayScene {
    let mesh = |mesh| vec![Part::new(mesh, Layout::Indexed32)];
    let at = |index: u32| Affine3A::from_translation(Vec3::new(3.5 * index as f32 + shift, shift, 0.0));
    let place = |index| Placed { custom_index: index, ..Placed::new(model, at(index)) };
    RayScene {
        models: vec![mesh(Mesh::torus(10)), mesh(Mesh::cube_grid(1))],
        placed: (0..count).map(place).collect(),
    }
}

#[test]
fn a_refit_may_follow_a_rebuild_to_another_count() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let gpu = instances_in_a_row(3, 0, 0.0).upload_with(&ctx, UPDATABLE, UPDATABLE, 8)?;
    let (five, moved) = (instances_in_a_row(5, 0, 0.0), instances_in_a_row(5, 0, 0.7));
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.update_tlas(*gpu.tlas, &instances(&five.placed, &gpu.models), BuildMode::Rebuild)?;
    cmd.update_tlas(*gpu.tlas, &instances(&moved.placed, &gpu.models), BuildMode::Refit)?;
    ctx.submit(cmd)?;
    HitCheck::new(&ctx)?.scene("rebuilt and refitted", &gpu.tlas, &moved)
}

/// A command that was refused has no effect on the next one, and BLASes that earlier commands reference stay alive
/// until those commands have run.
#[test]
fn a_refused_update_leaves_nothing_behind() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let mut gpu = instances_in_a_row(3, 0, 0.0).upload_with(&ctx, UPDATABLE, UPDATABLE, 8)?;
    let (two, four) = (instances_in_a_row(2, 0, 0.3), instances_in_a_row(4, 1, 0.4));
    let mut cmd = ctx.acquire_command_buffer()?;
    let shown = instances(&two.placed, &gpu.models);
    assert!(cmd.update_tlas(*gpu.tlas, &shown, BuildMode::Refit).is_err(), "three became two");
    let mut other = ctx.acquire_command_buffer()?;
    other.update_tlas(*gpu.tlas, &shown, BuildMode::Rebuild)?;
    ctx.submit(other)?;
    cmd.update_tlas(*gpu.tlas, &shown, BuildMode::Refit)?;
    cmd.update_tlas(*gpu.tlas, &instances(&four.placed, &gpu.models), BuildMode::Rebuild)?;
    drop(gpu.models.remove(0));
    ctx.submit(cmd)?;
    HitCheck::new(&ctx)?.scene("of the other mesh", &gpu.tlas, &four)
}

#[test]
fn hits_of_a_plain_mesh_are_its_own_whatever_was_submitted_since_it_was_recorded() -> Result<()> {
    let profile = DeviceProfile { name: "small".into(), max_blas_primitives: 40, ..DeviceProfile::default() };
    let Some(ctx) = device_with(|desc| desc.profile = Some(&profile)) else { return Ok(()) };
    let (split, plain) = (instances_in_a_row(2, 0, 0.0), instances_in_a_row(2, 1, 0.0));
    let gpu = split.upload_with(&ctx, BuildFlags::default(), BuildFlags::default(), 0)?;
    let shown = instances(&plain.placed, &gpu.models);
    let parts_per_instance = ctx.accel_struct_info(*gpu.models[0])?.parts;
    let desc = TlasDesc { instances: &shown, parts_per_instance, ..Default::default() };
    let tlas = ctx.create_tlas(&desc)?;
    ctx.wait_idle()?;
    let mut late = ctx.acquire_command_buffer()?;
    late.update_tlas(*tlas, &shown, BuildMode::Rebuild)?;
    let mut early = ctx.acquire_command_buffer()?;
    early.update_tlas(*tlas, &instances(&split.placed, &gpu.models), BuildMode::Rebuild)?;
    let check = HitCheck::new(&ctx)?;
    ctx.submit(early)?;
    check.scene("split", &tlas, &split)?;
    ctx.submit(late)?;
    check.scene("plain again", &tlas, &plain)
}
