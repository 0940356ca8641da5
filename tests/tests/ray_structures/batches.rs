//! Batches of acceleration structures: scratch and memory budgets, progress, shared buffers, and statistics.

use lvk::glam::{Affine3A, Vec3};
use lvk::{
    AccelMemory, AccelStructHandle, BlasDesc, BlasGeometry, BufferDesc, BufferHandle, BufferUsage,
    BuildFlags, BuildMode, Context, DeviceProfile, Error, Holder, Result, TlasDesc, Triangles,
    ValidationMode,
};
use lvk_tests::accel_backend::{
    builds_device_accel_structs, expect_parts, requires_device_accel_structs, software_alone,
};
use lvk_tests::hit_check::HitCheck;
use lvk_tests::hit_comparison::HitComparison;
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{Layout, Part, Placed, RayScene, instances, upload_geometries, vertex_bytes};
use lvk_tests::ray_tracer::{How, Method, RayTracer};
use lvk_tests::rays::random_rays;
use lvk_tests::warnings::{capture_warnings, take_warnings};
use lvk_tests::{TestDevice, device, device_with};

/// Fits a block of the memory of small acceleration structures many times.
const SMALL_STRUCTURE: u64 = 64 << 10;

/// Many little cubes in one vertex buffer, each half as large again as the one before the last five.
struct Cubes {
    _vertices: Holder<BufferHandle>,
    geometries: Vec<[BlasGeometry; 1]>,
}

fn cube(index: usize) -> Mesh {
    let mut mesh = Mesh::cube_grid(1);
    let scale = 0.6 + (index % 5) as f32 * 0.2;
    mesh.positions.iter_mut().flatten().for_each(|number| *number *= scale);
    mesh
}

impl Cubes {
    fn new(ctx: &Context, count: usize) -> Result<Self> {
        let bytes: Vec<u8> =
            (0..count).flat_map(|index| vertex_bytes(&cube(index), Layout::Unshared)).collect();
        let usage = BufferUsage::ACCEL_INPUT;
        let vertices = ctx.create_buffer(&BufferDesc { data: Some(&bytes), usage, ..Default::default() })?;
        let stride = bytes.len() / count;
        let geometry = |index| {
            let vertex_offset = (index * stride) as u64;
            [BlasGeometry::Triangles(Triangles { vertex_offset, ..Triangles::packed(*vertices, 36) })]
        };
        Ok(Self { geometries: (0..count).map(geometry).collect(), _vertices: vertices })
    }

    fn descs(&self) -> Vec<BlasDesc<'_>> {
        let desc = BlasDesc { debug_name: "cube", ..Default::default() };
        self.geometries.iter().map(|geometries| BlasDesc { geometries, ..desc }).collect()
    }

    /// All of them in rows.
    fn scene(&self) -> RayScene {
        let count = self.geometries.len();
        let models = (0..count).map(|index| vec![Part::new(cube(index), Layout::Unshared)]);
        let place = |index: usize| {
            let to = Vec3::new((index % 45) as f32, (index / 45) as f32, 0.0);
            Placed { custom_index: index as u32, ..Placed::new(index, Affine3A::from_translation(to)) }
        };
        RayScene { models: models.collect(), placed: (0..count).map(place).collect() }
    }
}

/// A device whose builds take 1 KiB of scratch a triangle, with so much for all together.
fn device_of_budget(scratch_budget_bytes: u64) -> Option<TestDevice> {
    let profile = DeviceProfile {
        name: "much scratch".into(),
        scratch_bytes_per_primitive: 1 << 10,
        ..DeviceProfile::default()
    };
    device_with(|desc| {
        desc.scratch_budget_bytes = scratch_budget_bytes;
        desc.profile = Some(&profile);
    })
}

fn handles(made: &[Holder<AccelStructHandle>]) -> Vec<AccelStructHandle> {
    made.iter().map(|holder| **holder).collect()
}

#[test]
fn two_thousand_accel_structs_are_built_within_a_scratch_budget() -> Result<()> {
    const BUDGET: u64 = 256 << 10;
    let Some(ctx) = device_of_budget(BUDGET)
        .filter(|ctx| requires_device_accel_structs(ctx, "a budget for builds of the driver"))
    else {
        return Ok(());
    };
    build_two_thousand(&ctx, BUDGET, BuildFlags::default())
}

/// Those that the GPU builds first; the CPU takes nothing of the budget.
#[test]
fn two_thousand_accel_structs_of_software_are_built_within_a_scratch_budget() -> Result<()> {
    const BUDGET: u64 = 64 << 10;
    let Some(ctx) = software_alone(|desc| desc.scratch_budget_bytes = BUDGET) else { return Ok(()) };
    build_two_thousand(&ctx, BUDGET, BuildFlags::FAST_BUILD)
}

/// The submission behind the batch traces what it builds; nothing waits for it.
fn build_two_thousand(ctx: &Context, budget: u64, flags: BuildFlags) -> Result<()> {
    const COUNT: usize = 2_000;
    let method = Method::available(ctx)[0];
    let tracer = RayTracer::new(ctx, method)?;
    let cubes = Cubes::new(ctx, COUNT)?;
    let descs: Vec<_> = cubes.descs().into_iter().map(|desc| BlasDesc { flags, ..desc }).collect();
    let each = ctx.blas_sizes(&descs[0])?.build_scratch_bytes;
    assert!(each * COUNT as u64 > 10 * budget, "{each} bytes of scratch each: the budget is no hindrance");
    ctx.wait_idle()?;
    let made = ctx.create_blas_batch(&descs)?;
    let all = handles(&made);
    let (scene, capacity) = (cubes.scene(), COUNT as u32);
    let shown = instances(&scene.placed, &made);
    let tlas = ctx.create_tlas(&TlasDesc { instances: &shown, capacity, ..Default::default() })?;
    let reference = scene.reference();
    let rays = random_rays(71, 400, Vec3::new(-1.0, -1.0, -1.0), Vec3::new(45.0, 45.0, 1.0));
    let records = tracer.trace(&tlas, &rays, How::default())?;
    HitComparison::of_triangles(&rays, &records, |ray| reference.closest(ray, 0xff)).assert("2,000 cubes");
    let alignment = u64::from(ctx.capabilities().limits.scratch_alignment);
    // The library's own kernels want theirs at multiples of 256, wherever the buffer begins.
    let top = ctx.accel_struct_sizes(*tlas)?.build_scratch_bytes.next_multiple_of(256) + 256;
    let scratch = ctx.accel_memory().scratch_bytes;
    assert!(scratch <= budget.max(top + alignment), "{scratch} bytes of scratch");
    let progress = ctx.build_progress(&all)?;
    assert_eq!((progress.built, progress.total), (COUNT, COUNT));
    Ok(())
}

#[test]
fn progress_counts_what_the_gpu_has_built() -> Result<()> {
    let Some(ctx) = device_of_budget(64 << 10) else { return Ok(()) };
    let cubes = Cubes::new(&ctx, 300)?;
    ctx.wait_idle()?;
    let made = ctx.create_blas_batch(&cubes.descs())?;
    let all = handles(&made);
    let mut last = ctx.build_progress(&all)?.built;
    assert!(last < 300, "the last builds wait for the next submission");
    let submission = ctx.flush()?;
    while !ctx.is_done(submission)? {
        let progress = ctx.build_progress(&all)?;
        assert!(progress.total == 300 && progress.built >= last, "{progress:?} after {last}");
        last = progress.built;
        std::thread::yield_now();
    }
    assert_eq!(ctx.build_progress(&all)?.built, 300);
    assert_eq!(ctx.build_progress(&all[..7])?.total, 7);
    assert_eq!(ctx.build_progress(&[])?.total, 0);
    let stale = all[3];
    drop(made);
    assert!(matches!(ctx.build_progress(&[stale]), Err(Error::StaleHandle { .. })));
    Ok(())
}

/// Rebuilds and refits of many share the scratch memory in the same way.
#[test]
fn rebuilds_keep_the_scratch_budget() -> Result<()> {
    const BUDGET: u64 = 128 << 10;
    let Some(ctx) = device_of_budget(BUDGET) else { return Ok(()) };
    let cubes = Cubes::new(&ctx, 200)?;
    let flags = BuildFlags::FAST_TRACE | BuildFlags::ALLOW_UPDATE;
    let descs: Vec<_> = cubes.descs().into_iter().map(|desc| BlasDesc { flags, ..desc }).collect();
    let made = ctx.create_blas_batch(&descs)?;
    for mode in [BuildMode::Rebuild, BuildMode::Refit] {
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.build_blas(&handles(&made), mode)?;
        ctx.submit(cmd)?;
    }
    ctx.wait_idle()?;
    let scratch = ctx.accel_memory().scratch_bytes;
    assert!(scratch <= BUDGET, "{scratch} bytes of scratch");
    let scene = cubes.scene();
    let shown = instances(&scene.placed, &made);
    let tlas = ctx.create_tlas(&TlasDesc { instances: &shown, ..Default::default() })?;
    HitCheck::new(&ctx)?.scene("rebuilt and refitted", &tlas, &scene)
}

#[test]
fn small_accel_structs_share_buffers() -> Result<()> {
    const COUNT: usize = 100;
    // Under validation in shaders each has its own.
    let shared = |validation| match validation {
        ValidationMode::GpuAssisted => ValidationMode::Standard,
        other => other,
    };
    let Some(ctx) = device_with(|desc| desc.validation = shared(desc.validation)) else { return Ok(()) };
    let cubes = Cubes::new(&ctx, COUNT)?;
    ctx.wait_idle()?;
    let before = ctx.accel_memory();
    let made = ctx.create_blas_batch(&cubes.descs())?;
    ctx.wait_idle()?;
    let after = ctx.accel_memory();
    let each = ctx.accel_struct_info(*made[0])?.structure_bytes;
    assert!(each.is_multiple_of(256) && each < SMALL_STRUCTURE, "{each} bytes");
    let grown = after.structure_bytes - before.structure_bytes;
    assert!(after.structures.iter().map(|info| info.structure_bytes).sum::<u64>() >= grown);
    assert_eq!(grown, each * COUNT as u64);
    // Their memory comes from a buffer that existed; none was added.
    assert_eq!(before.free_bytes, after.free_bytes + grown);
    drop(made);
    ctx.wait_idle()?;
    assert_eq!(ctx.accel_memory().free_bytes, before.free_bytes);
    Ok(())
}

fn of_structures(ctx: &Context) -> AccelMemory {
    AccelMemory { scratch_bytes: 0, ..ctx.accel_memory() }
}

/// The batch that does not fit is refused as a whole, and fits once others are gone.
#[test]
fn a_memory_budget_is_kept() -> Result<()> {
    const COUNT: usize = 60;
    let needed = {
        let Some(ctx) = device() else { return Ok(()) };
        let cubes = Cubes::new(&ctx, COUNT)?;
        let _made = ctx.create_blas_batch(&cubes.descs())?;
        ctx.wait_idle()?;
        ctx.accel_memory().structure_bytes
    };
    let Some(ctx) = device_with(|desc| desc.accel_budget_bytes = needed) else { return Ok(()) };
    let cubes = Cubes::new(&ctx, COUNT)?;
    let descs = cubes.descs();
    ctx.wait_idle()?;
    let empty = of_structures(&ctx);
    let mut made = ctx.create_blas_batch(&descs[..COUNT / 2])?;
    ctx.wait_idle()?;
    let half = of_structures(&ctx);
    let last = BlasDesc { debug_name: "the last straw", ..descs[COUNT - 1] };
    let more: Vec<_> = descs[..COUNT / 2].iter().copied().chain([last]).collect();
    let refused = ctx.create_blas_batch(&more);
    let Err(Error::OverBudget { object, bytes, used, budget }) = refused else {
        unreachable!("{:?}", refused.map(|made| made.len()))
    };
    assert!(object == "the last straw" && budget == needed, "{object}: {budget}");
    assert!(used <= budget && used + bytes > budget, "{bytes} beside {used} of {budget}");
    ctx.wait_idle()?;
    assert_eq!(of_structures(&ctx), half, "nothing is left behind");
    made.extend(ctx.create_blas_batch(&more[..COUNT / 2])?);
    let bytes = ctx.serialize_blas(*made[0])?;
    let loaded = BlasDesc { debug_name: "loaded", ..descs[0] };
    // SAFETY: the bytes are those of a BLAS of this description.
    let answers = unsafe {
        [ctx.load_blas(&loaded, &bytes).err(), ctx.load_or_create_blas(&loaded, Some(&bytes)).err()]
    };
    for answer in answers {
        assert!(
            matches!(&answer, Some(Error::OverBudget { object, .. }) if object == "loaded"),
            "{answer:?}"
        );
    }
    let tlas = ctx.create_tlas(&TlasDesc { debug_name: "one more", ..Default::default() });
    assert!(matches!(&tlas, Err(Error::OverBudget { object, .. }) if object == "one more"), "{tlas:?}");
    drop(made);
    ctx.wait_idle()?;
    assert_eq!(of_structures(&ctx), empty);
    let again = ctx.create_blas_batch(&descs)?;
    ctx.wait_idle()?;
    assert_eq!(ctx.accel_memory().structure_bytes, needed);
    drop(again);
    Ok(())
}

/// Their maps of primitives are on the way to the GPU when there turns out to be no memory.
#[test]
fn split_meshes_over_the_memory_budget_leave_nothing_behind() -> Result<()> {
    let profile =
        DeviceProfile { name: "small".into(), max_blas_primitives: 100, ..DeviceProfile::default() };
    let of_budget = |accel_budget_bytes| {
        device_with(|desc| {
            desc.profile = Some(&profile);
            desc.accel_budget_bytes = accel_budget_bytes;
        })
    };
    let parts = [Part::new(Mesh::torus(10), Layout::Indexed16)];
    let (needed, bytes) = {
        let Some(ctx) = of_budget(u64::MAX) else { return Ok(()) };
        let (_buffers, geometries) = upload_geometries(&ctx, &parts)?;
        let made = ctx.create_blas(&BlasDesc { geometries: &geometries, ..Default::default() })?;
        let bytes = ctx.serialize_blas(*made)?;
        (ctx.accel_memory().structure_bytes, bytes)
    };
    let Some(ctx) = of_budget(needed - 256) else { return Ok(()) };
    let (_buffers, geometries) = upload_geometries(&ctx, &parts)?;
    let desc = BlasDesc { geometries: &geometries, debug_name: "ring", ..Default::default() };
    let before = of_structures(&ctx);
    for submits in [true, false, true] {
        // SAFETY: the library wrote the bytes, on a context before.
        let loaded = unsafe { ctx.load_blas(&desc, &bytes) };
        for refused in [ctx.create_blas(&desc), loaded] {
            assert!(
                matches!(&refused, Err(Error::OverBudget { object, .. }) if object == "ring"),
                "{refused:?}"
            );
            if submits {
                ctx.wait_idle()?;
            }
        }
        assert_eq!(of_structures(&ctx), before);
    }
    Ok(())
}

/// Every reason for which a creation may fail half-way.
#[test]
fn failed_creations_leave_nothing_behind() -> Result<()> {
    let profile =
        DeviceProfile { name: "small".into(), max_blas_primitives: 100, ..DeviceProfile::default() };
    let Some(ctx) = device_with(|desc| desc.profile = Some(&profile)) else { return Ok(()) };
    let parts = [Part::new(Mesh::torus(10), Layout::Indexed16)];
    let (_buffers, geometries) = upload_geometries(&ctx, &parts)?;
    let good = BlasDesc { geometries: &geometries, debug_name: "good", ..Default::default() };
    ctx.wait_idle()?;
    let before = of_structures(&ctx);
    let BlasGeometry::Triangles(triangles) = geometries[0] else { unreachable!("triangles") };
    let gone = {
        let other = [Part::new(Mesh::cube_grid(1), Layout::Unshared)];
        let (_dropped, geometries) = upload_geometries(&ctx, &other)?;
        geometries
    };
    let outside = [BlasGeometry::Triangles(Triangles { vertex_offset: 1 << 40, ..triangles })];
    let flags = BuildFlags::FAST_TRACE | BuildFlags::FAST_BUILD;
    for bad in [
        BlasDesc { geometries: &[], ..good },
        BlasDesc { geometries: &gone, ..good },
        BlasDesc { geometries: &outside, ..good },
        BlasDesc { flags, ..good },
    ] {
        assert!(ctx.create_blas_batch(&[good, bad]).is_err(), "{bad:?}");
        assert!(ctx.create_blas(&bad).is_err());
        ctx.wait_idle()?;
        assert_eq!(of_structures(&ctx), before, "{bad:?}");
    }
    let made = ctx.create_blas(&good)?;
    let too_many = vec![lvk::TlasInstance { custom_index: 1 << 24, ..lvk::TlasInstance::new(*made) }];
    assert!(ctx.create_tlas(&TlasDesc { instances: &too_many, ..Default::default() }).is_err());
    drop(made);
    ctx.wait_idle()?;
    assert_eq!(of_structures(&ctx), before);
    Ok(())
}

/// Bytes between the vertices are read back too, in several copies that end anywhere.
#[test]
fn inputs_may_be_larger_than_what_is_read_back_at_once() -> Result<()> {
    const STRIDE: u64 = (1 << 20) + 12;
    let profile = DeviceProfile { name: "small".into(), max_blas_primitives: 30, ..DeviceProfile::default() };
    let Some(ctx) = device_with(|desc| desc.profile = Some(&profile)) else { return Ok(()) };
    let scene = RayScene::single(Mesh::torus(10), Layout::Indexed32);
    let (_buffers, geometries) = upload_geometries(&ctx, &scene.models[0])?;
    let BlasGeometry::Triangles(packed) = geometries[0] else { unreachable!("triangles") };
    let size_bytes = u64::from(packed.vertex_count) * STRIDE;
    assert!(size_bytes > 3 * (64 << 20), "{size_bytes} bytes");
    let usage = BufferUsage::ACCEL_INPUT;
    let wide = ctx.create_buffer(&BufferDesc { size_bytes, usage, ..Default::default() })?;
    for (vertex, position) in (0_u64..).zip(&scene.models[0][0].mesh.positions) {
        ctx.upload_buffer(*wide, vertex * STRIDE, bytemuck::cast_slice(position))?;
    }
    let spread = Triangles { vertex_buffer: *wide, vertex_offset: 0, vertex_stride: STRIDE, ..packed };
    let geometries = [BlasGeometry::Triangles(spread)];
    let blas = [ctx.create_blas(&BlasDesc { geometries: &geometries, ..Default::default() })?];
    expect_parts(&ctx, *blas[0], 7..)?;
    let shown = instances(&scene.placed, &blas);
    let tlas = ctx.create_tlas(&TlasDesc { instances: &shown, ..Default::default() })?;
    HitCheck::new(&ctx)?.scene("spread vertices", &tlas, &scene)
}

#[test]
fn statistics_name_every_accel_struct() -> Result<()> {
    let profile =
        DeviceProfile { name: "small".into(), max_blas_primitives: 100, ..DeviceProfile::default() };
    let Some(ctx) = device_with(|desc| desc.profile = Some(&profile)) else { return Ok(()) };
    let (_buffers, geometries) = upload_geometries(&ctx, &[Part::new(Mesh::torus(10), Layout::Indexed16)])?;
    let desc = BlasDesc { geometries: &geometries, debug_name: "the ring", ..Default::default() };
    let ring = ctx.create_blas(&desc)?;
    let shown = [lvk::TlasInstance::new(*ring)];
    let top =
        ctx.create_tlas(&TlasDesc { instances: &shown, debug_name: "the world", ..Default::default() })?;
    ctx.wait_idle()?;
    let memory = ctx.accel_memory();
    let find = |name: &str| memory.structures.iter().find(|info| info.name == name);
    let (Some(of_ring), Some(of_top)) = (find("the ring"), find("the world")) else {
        unreachable!("{memory:?}")
    };
    assert_eq!(memory.structures.len(), 2);
    assert_eq!((of_ring, of_top), (&ctx.accel_struct_info(*ring)?, &ctx.accel_struct_info(*top)?));
    assert!(!of_ring.is_top_level && of_top.is_top_level);
    expect_parts(&ctx, *ring, 4..=8)?;
    assert!(of_ring.is_remapped == builds_device_accel_structs(&ctx) && of_top.parts == 1);
    let of_map = if of_ring.is_remapped { 400 * 4 } else { 0 };
    assert!(of_ring.structure_bytes > 0 && of_ring.table_bytes >= of_map && of_top.structure_bytes > 0);
    assert!(memory.structure_bytes >= of_ring.structure_bytes + of_top.structure_bytes);
    drop(ring);
    assert_eq!(ctx.accel_memory().structures.len(), 1, "a structure without a handle is not listed");
    ctx.wait_idle()?;
    assert_eq!(ctx.accel_memory().structure_bytes, memory.structure_bytes, "but the world still shows it");
    Ok(())
}

/// Each of these is quiet but for the report of leaks, and for what is destroyed again.
#[test]
fn accel_structs_are_destroyed_in_any_order() -> Result<()> {
    capture_warnings();
    let profile =
        DeviceProfile { name: "small".into(), max_blas_primitives: 100, ..DeviceProfile::default() };
    for profile in [None, Some(&profile)] {
        let Some(device) = device_with(|desc| desc.profile = profile) else { return Ok(()) };
        let (Some(ctx), sink) = device.into_context() else { return Ok(()) };
        let (buffers, geometries) =
            upload_geometries(&ctx, &[Part::new(Mesh::torus(10), Layout::Indexed16)])?;
        let desc = |debug_name| BlasDesc {
            geometries: &geometries,
            flags: BuildFlags::FAST_TRACE | BuildFlags::ALLOW_COMPACTION,
            debug_name,
            ..Default::default()
        };
        let leaked = ctx.create_blas(&desc("forgotten ring"))?.release();
        let shown = [lvk::TlasInstance::new(leaked)];
        let top = TlasDesc { instances: &shown, debug_name: "forgotten world", ..Default::default() };
        ctx.create_tlas(&top)?.release();
        let held = ctx.create_blas(&desc("held ring"))?;
        let stale = *ctx.create_blas(&desc("gone ring"))?;
        ctx.destroy(stale);
        ctx.destroy(stale);
        assert!(ctx.create_blas(&BlasDesc { geometries: &[], ..desc("never made") }).is_err());
        ctx.compact(&[leaked])?;
        ctx.wait_idle()?;
        // Never built: its commands are not submitted any more.
        let unbuilt = ctx.create_blas(&desc("unbuilt ring"))?.release();
        assert!(ctx.build_progress(&[unbuilt])?.built == 0);
        drop((ctx, held, buffers));
        assert!(sink.is_empty(), "{:?}", sink.messages());
        let reports = take_warnings("forgotten ring");
        assert!(reports.len() == 1 && reports[0].contains("acceleration structure"), "{reports:?}");
        // Its holder had destroyed it before both calls.
        assert!(!reports[0].contains("gone ring") && take_warnings("gone ring").len() == 2, "{reports:?}");
        for (name, is_left) in
            [("forgotten world", true), ("unbuilt ring", true), ("held ring", false), ("never made", false)]
        {
            assert_eq!(reports[0].contains(name), is_left, "{name}: {reports:?}");
            assert_eq!(take_warnings(name), Vec::<String>::new());
        }
    }
    Ok(())
}
