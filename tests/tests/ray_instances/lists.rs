//! TLAS updates from one instance list after the other, from buffers and from the host, and lists recorded before a
//! compaction and submitted after it.

use lvk::glam::{Affine3A, Quat, Vec3};
use lvk::{
    AccelStructHandle, BufferHandle, BuildFlags, BuildMode, Compaction, Context, DeviceInstances, Holder,
    Result, TlasDesc, transform_rows,
};
use lvk_tests::compute::words_buffer;
use lvk_tests::device;
use lvk_tests::hit_check::HitCheck;
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{Layout, Part, Placed, RayScene, instances};

const COMPACTABLE: BuildFlags = BuildFlags::FAST_TRACE.union(BuildFlags::ALLOW_COMPACTION);
const UPDATABLE: BuildFlags = BuildFlags::FAST_TRACE.union(BuildFlags::ALLOW_UPDATE);

const RECORD_BYTES: usize = 64;

/// Instances of two models, turned by `turn` and moved apart.
fn scene(count: u32, turn: f32) -> RayScene {
    let models = vec![
        vec![Part::new(Mesh::torus(8), Layout::Indexed16)],
        vec![Part::new(Mesh::cube_grid(1), Layout::Unshared)],
    ];
    let place = |index: u32| {
        let turn = Quat::from_rotation_x(turn + index as f32);
        let to = Vec3::new((index % 3) as f32 * 3.0, (index / 3) as f32 * 3.0, 0.0);
        let transform = Affine3A::from_rotation_translation(turn, to);
        Placed { custom_index: 9_000 + index, ..Placed::new(index as usize % 2, transform) }
    };
    RayScene { models, placed: (0..count).map(place).collect() }
}

/// The records of a scene, its models at these places of the list of acceleration structures.
fn records(scene: &RayScene, places: [u32; 2]) -> Vec<u32> {
    let record = |placed: &Placed| {
        let rows = transform_rows(&placed.transform).map(f32::to_bits);
        let rest = [placed.custom_index | u32::from(placed.mask) << 24, 0, places[placed.model], 0];
        [&rows[..], &rest[..]].concat()
    };
    scene.placed.iter().flat_map(record).collect()
}

fn models(ctx: &Context, flags: BuildFlags) -> Result<Vec<Holder<AccelStructHandle>>> {
    Ok(scene(1, 0.0).upload_with(ctx, flags, BuildFlags::default(), 0)?.models)
}

fn update_tlas(
    ctx: &Context,
    tlas: AccelStructHandle,
    (buffer, count): (BufferHandle, u32),
    blas: &[AccelStructHandle],
    mode: BuildMode,
) -> Result<()> {
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.update_tlas_from_buffer(tlas, &DeviceInstances { buffer, offset: 0, count, blas }, mode)?;
    ctx.submit(cmd).map(drop)
}

/// More, fewer, moved; from a buffer and from the host in turn.
#[test]
fn an_accel_struct_takes_instances_from_anywhere() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    for flags in [BuildFlags::default(), BuildFlags::FAST_BUILD, COMPACTABLE] {
        let models = models(&ctx, flags)?;
        // A BLAS may be listed twice, and entries that no instance refers to do no harm.
        let blas = [*models[0], *models[0], *models[1]];
        let tlas = ctx.create_tlas(&TlasDesc { capacity: 9, flags: UPDATABLE, ..Default::default() })?;
        for (count, turn, mode) in [
            (6, 0.0, BuildMode::Rebuild),
            (6, 0.5, BuildMode::Refit),
            (9, 0.7, BuildMode::Auto { max_refits: 4 }),
            (9, 0.9, BuildMode::Auto { max_refits: 4 }),
            (2, 1.0, BuildMode::Rebuild),
        ] {
            let of_count = scene(count, turn);
            let buffer = words_buffer(&ctx, &records(&of_count, [1, 2]));
            update_tlas(&ctx, *tlas, (*buffer, count), &blas, mode)?;
            drop(buffer);
            check.scene(&format!("{count} from a buffer, {flags:?}"), &tlas, &of_count)?;
            let mut cmd = ctx.acquire_command_buffer()?;
            cmd.update_tlas(*tlas, &instances(&of_count.placed[1..], &models), BuildMode::Rebuild)?;
            cmd.update_tlas(*tlas, &instances(&of_count.placed, &models), BuildMode::Rebuild)?;
            ctx.submit(cmd)?;
            check.scene(&format!("{count} from the host, {flags:?}"), &tlas, &of_count)?;
        }
    }
    Ok(())
}

/// Recorded for the old acceleration structures, submitted when they have been replaced.
#[test]
fn an_update_that_is_overtaken_by_compaction_is_mended() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    let models = models(&ctx, COMPACTABLE)?;
    let blas = [*models[0], *models[1]];
    let scene = scene(6, 0.3);
    let buffer = words_buffer(&ctx, &records(&scene, [0, 1]));
    let tlas = ctx.create_tlas(&TlasDesc { capacity: 6, ..Default::default() })?;
    let mut cmd = ctx.acquire_command_buffer()?;
    let source = DeviceInstances { buffer: *buffer, offset: 0, count: 6, blas: &blas };
    cmd.update_tlas_from_buffer(*tlas, &source, BuildMode::Rebuild)?;
    ctx.compact(&blas)?;
    (0..3).try_for_each(|_| ctx.wait_idle())?;
    assert!(matches!(ctx.accel_struct_info(blas[0])?.compaction, Compaction::Done { .. }));
    ctx.submit(cmd)?;
    check.scene("right after", &tlas, &scene)?;
    ctx.upload_buffer(*buffer, 0, &vec![0xff; 6 * RECORD_BYTES])?;
    (0..3).try_for_each(|_| ctx.wait_idle())?;
    check.scene("later", &tlas, &scene)
}
