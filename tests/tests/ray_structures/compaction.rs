//! Compaction: an asynchronous second step that keeps the handle and its references, and frees memory.

use lvk::glam::{Affine3A, Quat, Vec3};
use lvk::test_hooks::{before_next_command_buffer, set_out_of_memory, waiting_objects, with_fault_injection};
use lvk::{
    AccelStructHandle, BufferDesc, BuildFlags, BuildMode, Compaction, Context, DeviceInstances, Error,
    MemoryKind, Result, TlasDesc,
};
use lvk_tests::accel_backend::{builds_device_accel_structs, requires_device_accel_structs};
use lvk_tests::compute::words_buffer;
use lvk_tests::hit_check::HitCheck;
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{GpuScene, Layout, Part, Placed, RayScene, instances};
use lvk_tests::vertex_deform::{VertexDeformer, deformed};
use lvk_tests::warnings::{capture_warnings, take_warnings};
use lvk_tests::{device, without_software};

pub(super) const COMPACTABLE: BuildFlags = BuildFlags::FAST_TRACE.union(BuildFlags::ALLOW_COMPACTION);
const MOVING: BuildFlags = COMPACTABLE.union(BuildFlags::ALLOW_UPDATE);

/// Three models, each shown twice.
pub(super) fn scene() -> RayScene {
    let model = |mesh| vec![Part::new(mesh, Layout::Indexed16)];
    let models = vec![model(Mesh::torus(10)), model(Mesh::sphere(12)), model(Mesh::cube_grid(2))];
    let place = |index: u32| {
        let turn = Quat::from_rotation_z(index as f32);
        let to = Vec3::new((index % 3) as f32 * 2.9, (index / 3) as f32 * 2.7, 0.0);
        let transform = Affine3A::from_rotation_translation(turn, to);
        Placed { custom_index: 20 + index, ..Placed::new(index as usize % 3, transform) }
    };
    RayScene { models, placed: (0..6).map(place).collect() }
}

pub(super) fn upload(ctx: &Context, scene: &RayScene, flags: BuildFlags) -> Result<GpuScene> {
    scene.upload_with(ctx, flags, BuildFlags::FAST_TRACE | BuildFlags::ALLOW_UPDATE, 8)
}

pub(super) fn handles(gpu: &GpuScene) -> Vec<AccelStructHandle> {
    gpu.models.iter().map(|model| **model).collect()
}

pub(super) fn compaction(ctx: &Context, handle: AccelStructHandle) -> Result<Compaction> {
    Ok(ctx.accel_struct_info(handle)?.compaction)
}

/// Bytes before and after.
pub(super) fn done(ctx: &Context, handle: AccelStructHandle) -> Result<(u64, u64)> {
    match compaction(ctx, handle)? {
        Compaction::Done { before_bytes, after_bytes } => Ok((before_bytes, after_bytes)),
        other => unreachable!("compacted by now, not {other:?}"),
    }
}

/// Fails unless an acceleration structure that is asked for waits for the GPU; what software traces has the size it needs, and is done at
/// once.
fn expect_pending(ctx: &Context, handle: AccelStructHandle) -> Result<()> {
    if builds_device_accel_structs(ctx) {
        assert_eq!(compaction(ctx, handle)?, Compaction::Pending);
    } else {
        expect_unchanged(ctx, handle)?;
    }
    Ok(())
}

/// Fails unless an acceleration structure is done, and takes what it took before.
pub(super) fn expect_unchanged(ctx: &Context, handle: AccelStructHandle) -> Result<()> {
    let (before_bytes, after_bytes) = done(ctx, handle)?;
    assert_eq!((before_bytes, after_bytes), (after_bytes, ctx.accel_struct_info(handle)?.structure_bytes));
    Ok(())
}

/// Lets the sizes arrive, the copies be made, and what they replaced go.
pub(super) fn wait_for_compaction(ctx: &Context) -> Result<()> {
    (0..3).try_for_each(|_| ctx.wait_idle())
}

/// Bytes of acceleration structures, the library's own included, and the sum of those with a handle.
pub(super) fn memory(ctx: &Context) -> (u64, u64) {
    let memory = ctx.accel_memory();
    (memory.structure_bytes, memory.structures.iter().map(|info| info.structure_bytes).sum())
}

#[test]
fn memory_goes_back_to_the_byte() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let scene = scene();
    let gpu = upload(&ctx, &scene, COMPACTABLE)?;
    let check = HitCheck::new(&ctx)?;
    ctx.wait_idle()?;
    let before: Vec<_> =
        handles(&gpu).into_iter().map(|handle| ctx.accel_struct_info(handle)).collect::<Result<_>>()?;
    let (all_before, own_before) = memory(&ctx);
    ctx.compact(&handles(&gpu)[..1])?;
    expect_pending(&ctx, *gpu.models[0])?;
    assert_eq!(compaction(&ctx, *gpu.models[1])?, Compaction::None);
    wait_for_compaction(&ctx)?;
    check.scene("one compacted", &gpu.tlas, &scene)?;
    ctx.compact(&handles(&gpu))?;
    wait_for_compaction(&ctx)?;
    check.scene("all compacted", &gpu.tlas, &scene)?;
    ctx.wait_idle()?;
    let mut saved = 0;
    for (model, was) in gpu.models.iter().zip(&before) {
        let (before_bytes, after_bytes) = done(&ctx, **model)?;
        let info = ctx.accel_struct_info(**model)?;
        assert_eq!((before_bytes, after_bytes), (was.structure_bytes, info.structure_bytes));
        assert!(after_bytes <= before_bytes);
        saved += before_bytes - after_bytes;
        eprintln!("{before_bytes} -> {after_bytes} bytes");
    }
    assert_eq!(memory(&ctx), (all_before - saved, own_before - saved));
    drop(gpu);
    ctx.wait_idle()?;
    assert_eq!(memory(&ctx), (all_before - own_before, 0), "only the library's own structure is left");
    Ok(())
}

/// An update that was recorded before the copies is submitted behind them. Another thread destroys the TLAS
/// just when it is to be written again.
#[test]
fn an_accel_struct_destroyed_while_rewritten_is_left_alone() -> Result<()> {
    let Some(ctx) =
        device().filter(|ctx| requires_device_accel_structs(ctx, "structures that are written again"))
    else {
        return Ok(());
    };
    let scene = scene();
    let gpu = upload(&ctx, &scene, COMPACTABLE)?;
    let mut late = ctx.acquire_command_buffer()?;
    late.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), BuildMode::Rebuild)?;
    ctx.compact(&handles(&gpu))?;
    wait_for_compaction(&ctx)?;
    done(&ctx, *gpu.models[0])?;
    ctx.wait(ctx.submit(late)?)?;
    let tlas = gpu.tlas;
    let (goes, gone) = std::sync::mpsc::channel();
    before_next_command_buffer(move || {
        drop(tlas);
        let _ = goes.send(());
    });
    ctx.next_frame()?;
    assert!(gone.try_recv().is_ok(), "it was to be written again");
    waiting_objects(&ctx)?;
    ctx.wait_idle()?;
    assert_eq!(waiting_objects(&ctx)?, 0);
    Ok(())
}

/// Instances from the host and from a buffer that changed since; no update tells them of the copies.
#[test]
fn older_tlases_reference_the_copies() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    let scene = scene();
    let gpu = upload(&ctx, &scene, COMPACTABLE)?;
    let mut words = Vec::new();
    for (index, placed) in scene.placed.iter().enumerate() {
        words.extend(lvk::transform_rows(&placed.transform).map(f32::to_bits));
        words.extend([placed.custom_index | 0xff << 24, 0, index as u32 % 3, 0]);
    }
    let records = words_buffer(&ctx, &words);
    let from_buffer = ctx.create_tlas(&TlasDesc { capacity: 6, ..Default::default() })?;
    let blas = handles(&gpu);
    let mut cmd = ctx.acquire_command_buffer()?;
    let source = DeviceInstances { buffer: *records, offset: 0, count: 6, blas: &blas };
    cmd.update_tlas_from_buffer(*from_buffer, &source, BuildMode::Rebuild)?;
    ctx.submit(cmd)?;
    ctx.compact(&blas)?;
    ctx.upload_buffer(*records, 0, &vec![0xff; words.len() * 4])?;
    drop(records);
    wait_for_compaction(&ctx)?;
    for handle in &blas {
        done(&ctx, *handle)?;
    }
    // The replaced memory is overwritten by other acceleration structures.
    let _others = upload(&ctx, &scene, BuildFlags::default())?;
    check.scene("host instances", &gpu.tlas, &scene)?;
    check.scene("device instances", &from_buffer, &scene)
}

/// The update was recorded for the old acceleration structures and is submitted when they are replaced.
#[test]
fn an_update_that_is_overtaken_by_compaction_is_mended() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    let mut scene = scene();
    let gpu = upload(&ctx, &scene, COMPACTABLE)?;
    ctx.wait_idle()?;
    let (all_before, own_before) = memory(&ctx);
    scene.placed.truncate(5);
    scene.placed[4].transform = Affine3A::from_translation(Vec3::new(1.0, 5.5, -0.5));
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), BuildMode::Rebuild)?;
    ctx.compact(&handles(&gpu))?;
    wait_for_compaction(&ctx)?;
    let saved =
        gpu.models.iter().map(|model| done(&ctx, **model)).map(|of| of.map(|(before, after)| before - after));
    let saved: u64 = saved.collect::<Result<Vec<_>>>()?.iter().sum();
    ctx.submit(cmd)?;
    check.scene("right after", &gpu.tlas, &scene)?;
    wait_for_compaction(&ctx)?;
    check.scene("later", &gpu.tlas, &scene)?;
    wait_for_compaction(&ctx)?;
    assert_eq!(memory(&ctx), (all_before - saved, own_before - saved), "the old structures are freed");
    Ok(())
}

#[test]
fn compaction_waits_for_builds_that_are_recorded() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    let scene = scene();
    for submits in [true, false] {
        let gpu = upload(&ctx, &scene, COMPACTABLE)?;
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.build_blas(&handles(&gpu)[..2], BuildMode::Rebuild)?;
        cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), BuildMode::Rebuild)?;
        ctx.compact(&handles(&gpu))?;
        wait_for_compaction(&ctx)?;
        expect_pending(&ctx, *gpu.models[0])?;
        done(&ctx, *gpu.models[2])?;
        if submits {
            ctx.submit(cmd)?;
        } else {
            drop(cmd);
        }
        wait_for_compaction(&ctx)?;
        wait_for_compaction(&ctx)?;
        for model in &gpu.models {
            done(&ctx, **model)?;
        }
        check.scene(&format!("built meanwhile: {submits}"), &gpu.tlas, &scene)?;
    }
    Ok(())
}

/// The TLAS that is written again still shows a destroyed BLAS, whose handle is stale nevertheless.
#[test]
fn a_destroyed_blas_stays_stale_when_its_tlas_is_written_again() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let scene = scene();
    let mut gpu = upload(&ctx, &scene, COMPACTABLE)?;
    let shown = instances(&scene.placed, &gpu.models);
    drop(gpu.models.pop());
    ctx.compact(&handles(&gpu))?;
    wait_for_compaction(&ctx)?;
    ctx.wait_idle()?;
    let mut cmd = ctx.acquire_command_buffer()?;
    let updated = cmd.update_tlas(*gpu.tlas, &shown, BuildMode::Rebuild);
    assert!(matches!(updated, Err(Error::StaleHandle { .. })), "{updated:?}");
    Ok(())
}

/// Another thread records a build just when the copy begins: the new memory is not needed then, and goes back.
#[test]
fn a_copy_that_a_build_overtakes_is_put_off() -> Result<()> {
    let Some(ctx) = device().filter(|ctx| requires_device_accel_structs(ctx, "structures that are copied"))
    else {
        return Ok(());
    };
    let check = HitCheck::new(&ctx)?;
    let scene = scene();
    let gpu = upload(&ctx, &scene, COMPACTABLE)?;
    let first = *gpu.models[0];
    ctx.compact(&[first])?;
    ctx.wait_idle()?;
    let mut cmd = ctx.acquire_command_buffer()?;
    let (give, take) = std::sync::mpsc::channel();
    before_next_command_buffer(move || {
        let recording =
            std::thread::spawn(move || cmd.build_blas(&[first], BuildMode::Rebuild).map(|()| cmd));
        let _ = give.send(recording.join());
    });
    ctx.next_frame()?;
    let Ok(Ok(recorded)) = take.try_recv() else { unreachable!("the copy was to begin") };
    expect_pending(&ctx, first)?;
    ctx.submit(recorded?)?;
    wait_for_compaction(&ctx)?;
    wait_for_compaction(&ctx)?;
    done(&ctx, first)?;
    check.scene("built when the copy began", &gpu.tlas, &scene)
}

/// A build between the question and the copy makes the answer worthless: it is asked again.
#[test]
fn a_build_after_the_question_makes_another_one() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let mut scene = scene();
    let gpu = upload(&ctx, &scene, COMPACTABLE)?;
    ctx.compact(&handles(&gpu))?;
    let mut cmd = ctx.acquire_command_buffer()?;
    let mesh = scene.models[0][0].mesh.clone();
    VertexDeformer::new(&ctx)?.record(&mut cmd, *gpu.buffers[0].vertices, &mesh, 0.4)?;
    cmd.build_blas(&handles(&gpu), BuildMode::Rebuild)?;
    cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), BuildMode::Rebuild)?;
    ctx.submit(cmd)?;
    scene.models[0][0].mesh = deformed(&mesh, 0.4);
    wait_for_compaction(&ctx)?;
    wait_for_compaction(&ctx)?;
    for model in &gpu.models {
        done(&ctx, **model)?;
    }
    HitCheck::new(&ctx)?.scene("built again", &gpu.tlas, &scene)
}

/// The usual life of a moving mesh: a refit a frame, none of which waits, and compaction somewhere in between.
#[test]
fn a_mesh_is_compacted_while_it_moves() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let (deformer, check) = (VertexDeformer::new(&ctx)?, HitCheck::new(&ctx)?);
    let mut scene = scene();
    let gpu = upload(&ctx, &scene, MOVING)?;
    let mut done_at = None;
    for frame in 0..8 {
        ctx.next_frame()?;
        let mesh = scene.models[0][0].mesh.clone();
        let mut cmd = ctx.acquire_command_buffer()?;
        deformer.record(&mut cmd, *gpu.buffers[0].vertices, &mesh, 0.1)?;
        cmd.build_blas(&[*gpu.models[0]], BuildMode::Refit)?;
        cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), BuildMode::Refit)?;
        if frame == 2 {
            ctx.compact(&handles(&gpu))?;
        }
        ctx.submit(cmd)?;
        scene.models[0][0].mesh = deformed(&mesh, 0.1);
        check.scene(&format!("frame {frame}"), &gpu.tlas, &scene)?;
        if done_at.is_none() && matches!(compaction(&ctx, *gpu.models[0])?, Compaction::Done { .. }) {
            done_at = Some(frame);
        }
    }
    assert!(done_at.is_some_and(|frame| (2..7).contains(&frame)), "{done_at:?}");
    Ok(())
}

/// The copy has no memory for a rebuild. A BLAS for software ray queries alone is not copied and is rebuilt as usual.
#[test]
fn a_compacted_accel_struct_cannot_be_rebuilt() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let (mut scene, deformer) = (scene(), VertexDeformer::new(&ctx)?);
    let gpu = upload(&ctx, &scene, MOVING)?;
    ctx.compact(&handles(&gpu))?;
    wait_for_compaction(&ctx)?;
    done(&ctx, *gpu.models[0])?;
    let mesh = scene.models[0][0].mesh.clone();
    let mut cmd = ctx.acquire_command_buffer()?;
    if builds_device_accel_structs(&ctx) {
        let refused = cmd.build_blas(&[*gpu.models[0]], BuildMode::Rebuild);
        let Err(Error::InvalidUsage { object, message }) = refused else { unreachable!("{refused:?}") };
        assert!(object == "model" && message.contains("compacted"), "{object}: {message}");
    } else {
        deformer.record(&mut cmd, *gpu.buffers[0].vertices, &mesh, 0.4)?;
        cmd.build_blas(&[*gpu.models[0]], BuildMode::Rebuild)?;
        cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), BuildMode::Rebuild)?;
        scene.models[0][0].mesh = deformed(&mesh, 0.4);
    }
    ctx.submit(cmd)?;
    HitCheck::new(&ctx)?.scene("after a refusal, or rebuilt", &gpu.tlas, &scene)
}

/// Worn out or not: another refit is all that can be done.
#[test]
fn automatic_builds_refit_on_what_is_compacted() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let (deformer, check) = (VertexDeformer::new(&ctx)?, HitCheck::new(&ctx)?);
    let mut scene = scene();
    let gpu = upload(&ctx, &scene, MOVING)?;
    ctx.compact(&handles(&gpu))?;
    wait_for_compaction(&ctx)?;
    done(&ctx, *gpu.models[0])?;
    for (frame, max_refits) in [2, 2, 2, 2, 0].into_iter().enumerate() {
        let mesh = scene.models[0][0].mesh.clone();
        let mut cmd = ctx.acquire_command_buffer()?;
        deformer.record(&mut cmd, *gpu.buffers[0].vertices, &mesh, 0.1)?;
        cmd.build_blas(&handles(&gpu), BuildMode::Auto { max_refits })?;
        cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), BuildMode::Refit)?;
        ctx.submit(cmd)?;
        scene.models[0][0].mesh = deformed(&mesh, 0.1);
        check.scene(&format!("frame {frame}"), &gpu.tlas, &scene)?;
    }
    let still = upload(&ctx, &scene, COMPACTABLE)?;
    ctx.compact(&handles(&still))?;
    wait_for_compaction(&ctx)?;
    let mut cmd = ctx.acquire_command_buffer()?;
    let built = cmd.build_blas(&handles(&still), BuildMode::Auto { max_refits: 2 });
    if builds_device_accel_structs(&ctx) {
        assert!(matches!(built, Err(Error::InvalidUsage { .. })), "neither way is open: {built:?}");
        return Ok(());
    }
    built?;
    cmd.update_tlas(*still.tlas, &instances(&scene.placed, &still.models), BuildMode::Rebuild)?;
    ctx.submit(cmd)?;
    check.scene("rebuilt, as refits are not allowed", &still.tlas, &scene)
}

#[test]
fn asking_twice_is_asking_once_and_wrong_questions_are_refused() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let scene = scene();
    let gpu = upload(&ctx, &scene, COMPACTABLE)?;
    let plain = upload(&ctx, &scene, BuildFlags::default())?;
    let refused = |result: Result<()>, name: &str| match result {
        Err(Error::InvalidUsage { object, .. }) => assert_eq!(object, name),
        other => unreachable!("{name}: {other:?}"),
    };
    refused(ctx.compact(&[*gpu.models[0], *plain.models[0]]), "model");
    assert_eq!(compaction(&ctx, *gpu.models[0])?, Compaction::None, "all or none");
    refused(ctx.compact(&[*gpu.tlas]), "tlas");
    let stale = {
        let [first, ..] = handles(&plain)[..] else { unreachable!("three models") };
        drop(plain);
        first
    };
    assert!(matches!(ctx.compact(&[*gpu.models[0], stale]), Err(Error::StaleHandle { .. })));
    ctx.compact(&[])?;
    ctx.compact(&[*gpu.models[0], *gpu.models[0]])?;
    ctx.compact(&[*gpu.models[0]])?;
    wait_for_compaction(&ctx)?;
    let sizes = done(&ctx, *gpu.models[0])?;
    ctx.compact(&handles(&gpu))?;
    wait_for_compaction(&ctx)?;
    assert_eq!(done(&ctx, *gpu.models[0])?, sizes, "left alone");
    HitCheck::new(&ctx)?.scene("asked often", &gpu.tlas, &scene)
}

/// Cases: every state of the compaction.
#[test]
fn accel_structs_may_be_destroyed_meanwhile() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    let scene = scene();
    ctx.wait_idle()?;
    let before = memory(&ctx);
    for steps in 0..3 {
        let mut gpu = upload(&ctx, &scene, COMPACTABLE)?;
        ctx.compact(&handles(&gpu))?;
        (0..steps).try_for_each(|_| ctx.flush().map(drop))?;
        gpu.models.clear();
        gpu.buffers.clear();
        wait_for_compaction(&ctx)?;
        check.scene(&format!("destroyed after {steps} submissions"), &gpu.tlas, &scene)?;
        drop(gpu);
        wait_for_compaction(&ctx)?;
        assert_eq!(memory(&ctx), before, "{steps} submissions");
    }
    Ok(())
}

/// Nothing else keeps them.
#[test]
fn unreferenced_accel_structs_may_be_destroyed_meanwhile() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let scene = scene();
    ctx.wait_idle()?;
    let before = memory(&ctx);
    for steps in 0..8 {
        let GpuScene { models, tlas, buffers } = upload(&ctx, &scene, COMPACTABLE)?;
        drop(tlas);
        let handles: Vec<_> = models.iter().map(|model| **model).collect();
        if steps % 2 == 1 {
            ctx.wait_idle()?;
        }
        ctx.compact(&handles)?;
        (0..steps / 2).try_for_each(|_| ctx.flush().map(drop))?;
        drop((models, buffers));
        wait_for_compaction(&ctx)?;
        assert_eq!(memory(&ctx), before, "step {steps}");
    }
    Ok(())
}

/// Cases: every state of the compaction, with work that was never submitted.
#[test]
fn a_context_may_go_meanwhile() -> Result<()> {
    for steps in 0..4 {
        let Some(device) = device() else { return Ok(()) };
        let (Some(ctx), sink) = device.into_context() else { return Ok(()) };
        let gpu = upload(&ctx, &scene(), COMPACTABLE)?;
        ctx.compact(&handles(&gpu))?;
        (0..steps).try_for_each(|_| ctx.flush().map(drop))?;
        if steps == 3 {
            ctx.wait_idle()?;
            ctx.next_frame()?;
        }
        drop(ctx);
        drop(gpu);
        assert!(sink.is_empty(), "{steps} submissions: {:?}", sink.messages());
    }
    Ok(())
}

/// A TLAS keeps referencing replaced BLAS where memory to write it again lacks. The next submission tries again, and the replaced
/// memory is freed.
#[test]
fn a_tlas_that_could_not_be_written_again_is_written_later() -> Result<()> {
    capture_warnings();
    let Some(ctx) = with_fault_injection(|| without_software(|_| ())) else { return Ok(()) };
    if !requires_device_accel_structs(&ctx, "copies of structures") {
        return Ok(());
    }
    let model = vec![Part::new(Mesh::torus(10), Layout::Indexed16)];
    let place = |index: u32| Placed::new(0, Affine3A::from_translation(Vec3::X * (3 * index) as f32));
    let scene = RayScene { models: vec![model], placed: (0..6).map(place).collect() };
    let gpu = scene.upload_with(&ctx, COMPACTABLE, BuildFlags::FAST_TRACE, 6)?;
    let other = scene.upload_with(&ctx, BuildFlags::FAST_TRACE, BuildFlags::FAST_TRACE, 6)?;
    ctx.wait_idle()?;
    let needed = memory(&ctx).0;
    ctx.compact(&handles(&gpu))?;
    ctx.wait_idle()?;
    waiting_objects(&ctx)?;
    // Memory for what the kernel reads that writes the instances again is full: first the block, then the pages in it.
    set_out_of_memory(true);
    let filler = BufferDesc { size_bytes: 64 << 10, memory: MemoryKind::Readback, ..Default::default() };
    let fillers: Vec<_> = std::iter::from_fn(|| ctx.create_buffer(&filler).ok()).collect();
    let mut full = ctx.acquire_command_buffer()?;
    let placed = instances(&scene.placed, &other.models);
    let is_full = (0..10_000).any(|_| full.update_tlas(*other.tlas, &placed, BuildMode::Rebuild).is_err());
    assert!(is_full, "no update of a TLAS lacks memory");
    ctx.flush()?;
    set_out_of_memory(false);
    assert_eq!(take_warnings("each later submission tries again").len(), 1);
    drop((full, fillers));
    wait_for_compaction(&ctx)?;
    let (before_bytes, after_bytes) = done(&ctx, *gpu.models[0])?;
    assert_eq!(memory(&ctx).0, needed - before_bytes + after_bytes);
    HitCheck::new(&ctx)?.scene("written later", &gpu.tlas, &scene)
}

/// Compactions of one thread are carried out by whatever thread submits next.
#[test]
fn threads_compact_side_by_side() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let work = || -> Result<()> {
        let (check, scene) = (HitCheck::new(&ctx)?, scene());
        for round in 0..5 {
            let gpu = upload(&ctx, &scene, MOVING)?;
            ctx.compact(&handles(&gpu))?;
            for frame in 0..3 {
                let mut cmd = ctx.acquire_command_buffer()?;
                cmd.build_blas(&handles(&gpu), BuildMode::Refit)?;
                cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), BuildMode::Refit)?;
                ctx.submit(cmd)?;
                check.scene(&format!("round {round}, frame {frame}"), &gpu.tlas, &scene)?;
            }
        }
        Ok(())
    };
    std::thread::scope(|scope| {
        let threads = [scope.spawn(work), scope.spawn(work)];
        threads.into_iter().try_for_each(|thread| thread.join().unwrap_or_else(|_| unreachable!("it failed")))
    })
}
