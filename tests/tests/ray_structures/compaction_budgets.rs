//! Compaction with a budget that has no memory, or little, for the copies.

use lvk::{BuildMode, Compaction, Result};
use lvk_tests::accel_backend::{requires_device_accel_structs, software_alone};
use lvk_tests::hit_check::HitCheck;
use lvk_tests::ray_scene::GpuScene;
use lvk_tests::warnings::{capture_warnings, take_warnings};
use lvk_tests::{TestDevice, device, device_with, without_software};

use super::compaction::{
    COMPACTABLE, compaction, done, expect_unchanged, handles, memory, scene, upload, wait_for_compaction,
};

/// Bytes before and after compaction.
type Sizes = (u64, u64);

/// Bytes of all acceleration structures, and of each of the [`scene`]'s; nothing, loudly, where there are no copies.
fn measured(ctx: Option<TestDevice>) -> Result<Option<(u64, Vec<Sizes>)>> {
    let Some(ctx) = ctx else { return Ok(None) };
    if !requires_device_accel_structs(&ctx, "copies that need room") {
        return Ok(None);
    }
    let gpu = upload(&ctx, &scene(), COMPACTABLE)?;
    ctx.wait_idle()?;
    let needed = memory(&ctx).0;
    ctx.compact(&handles(&gpu))?;
    wait_for_compaction(&ctx)?;
    let sizes = handles(&gpu).into_iter().map(|handle| done(&ctx, handle));
    Ok(Some((needed, sizes.collect::<Result<_>>()?)))
}

/// Software BVHs are not copied, so a budget for the acceleration structures themselves is enough.
#[test]
fn software_accel_structs_are_compacted_without_memory_for_copies() -> Result<()> {
    let scene = scene();
    let needed = {
        let Some(ctx) = software_alone(|_| ()) else { return Ok(()) };
        let _gpu = upload(&ctx, &scene, COMPACTABLE)?;
        ctx.wait_idle()?;
        memory(&ctx).0
    };
    let Some(ctx) = software_alone(|desc| desc.accel_budget_bytes = needed) else { return Ok(()) };
    let gpu = upload(&ctx, &scene, COMPACTABLE)?;
    ctx.compact(&handles(&gpu))?;
    handles(&gpu).into_iter().try_for_each(|handle| expect_unchanged(&ctx, handle))?;
    wait_for_compaction(&ctx)?;
    assert_eq!(memory(&ctx).0, needed);
    HitCheck::new(&ctx)?.scene("compacted, and as before", &gpu.tlas, &scene)
}

/// Copies need room beside what they replace. Without it everything stays as it is, with a warning for each.
#[test]
fn compaction_fails_where_the_budget_has_no_memory_for_copies() -> Result<()> {
    capture_warnings();
    let Some((needed, sizes)) = measured(device())? else { return Ok(()) };
    let Some(ctx) = device_with(|desc| desc.accel_budget_bytes = needed + 256) else {
        return Ok(());
    };
    let scene = scene();
    let gpu = upload(&ctx, &scene, COMPACTABLE)?;
    ctx.compact(&handles(&gpu))?;
    wait_for_compaction(&ctx)?;
    for model in &gpu.models {
        assert_eq!(compaction(&ctx, **model)?, Compaction::Failed);
    }
    assert_eq!(memory(&ctx).0, needed);
    let mut warnings = take_warnings("stays uncompacted");
    warnings.retain(|warning| warning.contains(&format!("budget of {}", needed + 256)));
    assert_eq!(warnings.len(), 3, "{warnings:?}");
    HitCheck::new(&ctx)?.scene("not compacted", &gpu.tlas, &scene)?;
    // A second request succeeds after other objects were destroyed.
    let GpuScene { mut models, tlas, .. } = gpu;
    drop((tlas, models.pop(), models.pop()));
    ctx.wait_idle()?;
    ctx.compact(&[*models[0]])?;
    assert_eq!(compaction(&ctx, *models[0])?, Compaction::Pending);
    wait_for_compaction(&ctx)?;
    assert_eq!(done(&ctx, *models[0])?, sizes[0]);
    Ok(())
}

/// Memory suffices for the smallest copy only. Freed memory is used for more copies, and the rest fails alone.
#[test]
fn structures_that_fit_are_compacted_whatever_becomes_of_the_rest() -> Result<()> {
    let Some((needed, sizes)) = measured(without_software(|_| ()))? else { return Ok(()) };
    let smallest = sizes.iter().map(|(_, after)| *after).min().unwrap_or(0);
    let Some(ctx) = without_software(|desc| desc.accel_budget_bytes = needed + smallest) else {
        return Ok(());
    };
    let scene = scene();
    let gpu = upload(&ctx, &scene, COMPACTABLE)?;
    ctx.compact(&handles(&gpu))?;
    wait_for_compaction(&ctx)?;
    wait_for_compaction(&ctx)?;
    let mut room = smallest;
    let mut order: Vec<_> = (0..sizes.len()).collect();
    order.sort_by_key(|index| sizes[*index].1);
    let mut expected = vec![Compaction::Failed; sizes.len()];
    for index in order {
        let (before_bytes, after_bytes) = sizes[index];
        if after_bytes <= room {
            room += before_bytes - after_bytes;
            expected[index] = Compaction::Done { before_bytes, after_bytes };
        }
    }
    eprintln!("{sizes:?}: {expected:?}");
    for (model, expected) in gpu.models.iter().zip(&expected) {
        assert_eq!(compaction(&ctx, **model)?, *expected);
    }
    HitCheck::new(&ctx)?.scene("some compacted", &gpu.tlas, &scene)
}

/// Room for one copy at a time: the next is made when what the last one replaced is freed.
#[test]
fn copies_wait_for_the_memory_of_other_copies() -> Result<()> {
    let Some((needed, sizes)) = measured(without_software(|_| ()))? else { return Ok(()) };
    let largest = sizes.iter().map(|(_, after)| *after).max().unwrap_or(0);
    let Some(ctx) = without_software(|desc| desc.accel_budget_bytes = needed + largest) else {
        return Ok(());
    };
    let scene = scene();
    let gpu = upload(&ctx, &scene, COMPACTABLE)?;
    ctx.compact(&handles(&gpu))?;
    ctx.wait_idle()?;
    let mut pending = Vec::new();
    for _ in 0..6 {
        ctx.flush()?;
        let states: Result<Vec<_>> =
            handles(&gpu).into_iter().map(|handle| compaction(&ctx, handle)).collect();
        pending.push(states?.iter().filter(|state| **state == Compaction::Pending).count());
        ctx.wait_idle()?;
    }
    eprintln!("{sizes:?}: pending {pending:?}");
    assert!(pending[0] > 0, "{pending:?}");
    for (model, sizes) in gpu.models.iter().zip(&sizes) {
        assert_eq!(done(&ctx, **model)?, *sizes);
    }
    HitCheck::new(&ctx)?.scene("one after the other", &gpu.tlas, &scene)
}

/// A copy that waits for room does not keep what was destroyed.
#[test]
fn structures_that_wait_for_memory_may_be_destroyed() -> Result<()> {
    let Some((needed, sizes)) = measured(without_software(|_| ()))? else { return Ok(()) };
    let Some(ctx) = without_software(|desc| desc.accel_budget_bytes = needed + 256) else {
        return Ok(());
    };
    let GpuScene { mut models, tlas, buffers: _buffers } = upload(&ctx, &scene(), COMPACTABLE)?;
    drop(tlas);
    // A build that is not submitted keeps the compaction of the others going.
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.build_blas(&[*models[2]], BuildMode::Rebuild)?;
    let all: Vec<_> = models.iter().map(|model| **model).collect();
    ctx.compact(&all)?;
    wait_for_compaction(&ctx)?;
    assert_eq!(compaction(&ctx, *models[0])?, Compaction::Pending);
    // The largest, in whose place both others have room.
    drop(models.remove(1));
    drop(cmd);
    wait_for_compaction(&ctx)?;
    wait_for_compaction(&ctx)?;
    assert_eq!([done(&ctx, *models[0])?, done(&ctx, *models[1])?], [sizes[0], sizes[2]]);
    Ok(())
}
