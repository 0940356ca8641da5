//! Serialized BLASes: a loaded BLAS gives the hits of a built one, and unusable bytes are refused.

use std::cell::Cell;
use std::rc::Rc;

use lvk::glam::{Affine3A, Vec3};
use lvk::test_hooks::before_serialize_copies;
use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BuildFlags, BuildMode, Compaction, Context, DeviceProfile,
    Error, GeometryFlags, GeometryTransform, Holder, IndexFormat, Indices, LoadedBlas, PrimitiveOrder,
    Result, TlasDesc, Triangles, VertexFormat,
};
use lvk_tests::accel_backend::{builds_device_accel_structs, whole_and_split};
use lvk_tests::hit_check::HitCheck;
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{Layout, Part, PartBuffers, Placed, RayScene, instances, upload_geometries};
use lvk_tests::rays::random_rays;
use lvk_tests::sphere_scene::SphereModel;
use lvk_tests::vertex_deform::{VertexDeformer, deformed};
use lvk_tests::warnings::{capture_warnings, take_warnings};
use lvk_tests::{TestDevice, device, device_with};

const MOVING: BuildFlags =
    BuildFlags::FAST_TRACE.union(BuildFlags::ALLOW_UPDATE).union(BuildFlags::ALLOW_COMPACTION);

/// Primitive limit of a BLAS on devices that split.
const MOST_PRIMITIVES: u64 = 60;

/// Creates a context that splits BLASes of more primitives.
fn split_device() -> Option<TestDevice> {
    let profile = DeviceProfile {
        name: "small structures".into(),
        max_blas_primitives: MOST_PRIMITIVES,
        // A few parts: they go through several buffers.
        max_accel_structure_bytes: 16 << 10,
        ..DeviceProfile::default()
    };
    device_with(|desc| desc.profile = Some(&profile))
}

/// A shuffled ring and a cube that is moved before the build, in two places.
fn scene() -> RayScene {
    let ring = Mesh::torus(10);
    let count = ring.triangles.len();
    let triangles = (0..count).map(|index| ring.triangles[index * 211 % count]).collect();
    let ring = Part::new(Mesh { triangles, ..ring }, Layout::Indexed16);
    let cube = Part {
        transform: Some(Affine3A::from_translation(Vec3::Y * 1.5)),
        ..Part::new(Mesh::cube_grid(1), Layout::Unshared)
    };
    let place = |index: u32| {
        let transform = Affine3A::from_translation(Vec3::X * 3.0 * index as f32);
        Placed { custom_index: 7 + index, ..Placed::new(0, transform) }
    };
    RayScene { models: vec![vec![ring, cube]], placed: (0..2).map(place).collect() }
}

/// The geometries of [`scene`] on a device.
struct Mine {
    scene: RayScene,
    buffers: Vec<PartBuffers>,
    geometries: Vec<BlasGeometry>,
}

impl Mine {
    fn new(ctx: &Context) -> Result<Self> {
        let scene = scene();
        let (buffers, geometries) = upload_geometries(ctx, &scene.models[0])?;
        Ok(Self { scene, buffers, geometries })
    }

    fn desc(&self, flags: BuildFlags, order: PrimitiveOrder) -> BlasDesc<'_> {
        BlasDesc { geometries: &self.geometries, flags, order, debug_name: "mine", ..BlasDesc::default() }
    }

    fn tlas_of(&self, ctx: &Context, blas: &Holder<AccelStructHandle>) -> Result<Holder<AccelStructHandle>> {
        let instances = self.scene.placed.iter().map(|placed| lvk::TlasInstance {
            transform: lvk::transform_rows(&placed.transform),
            custom_index: placed.custom_index,
            ..lvk::TlasInstance::new(**blas)
        });
        let (flags, instances) = (BuildFlags::ALLOW_UPDATE, instances.collect::<Vec<_>>());
        ctx.create_tlas(&TlasDesc { instances: &instances, flags, ..Default::default() })
    }
}

fn load(ctx: &Context, desc: &BlasDesc<'_>, bytes: &[u8]) -> Result<Holder<AccelStructHandle>> {
    // SAFETY: what the driver once wrote of an acceleration structure is as it was, or its head tells that it is not.
    unsafe { ctx.load_blas(desc, bytes) }
}

fn load_or_create(ctx: &Context, desc: &BlasDesc<'_>, bytes: Option<&[u8]>) -> Result<LoadedBlas> {
    // SAFETY: as above.
    unsafe { ctx.load_or_create_blas(desc, bytes) }
}

fn wait_for_compaction(ctx: &Context) -> Result<()> {
    (0..3).try_for_each(|_| ctx.wait_idle())
}

fn reason(result: Result<Holder<AccelStructHandle>>) -> String {
    match result {
        Err(Error::Serialized { object, reason }) => {
            assert_eq!(object, "mine");
            reason
        }
        other => unreachable!("the bytes are no good, but {other:?}"),
    }
}

/// The driver's data may have another size after a build, and would be written beyond the buffer.
#[test]
fn bytes_are_of_one_state_though_the_blas_is_built_meanwhile() -> Result<()> {
    for (split, mode) in [(false, BuildMode::Refit), (false, BuildMode::Rebuild), (true, BuildMode::Rebuild)]
    {
        let Some(ctx) = (if split { split_device() } else { device() }) else { return Ok(()) };
        if !builds_device_accel_structs(&ctx) {
            continue;
        }
        let check = HitCheck::new(&ctx)?;
        let mut mine = Mine::new(&ctx)?;
        let blas = Rc::new(ctx.create_blas(&mine.desc(MOVING, PrimitiveOrder::Given))?);
        let (mesh, vertices) = (mine.scene.models[0][0].mesh.clone(), *mine.buffers[0].vertices);
        let builds = Rc::new(Cell::new(0));
        let deformer = VertexDeformer::new(&ctx)?;
        let (other, built, before) = (Context::clone(&ctx), Rc::clone(&blas), mesh.clone());
        let count = Rc::clone(&builds);
        before_serialize_copies(Some(Box::new(move || {
            count.set(count.get() + 1);
            let mut cmd = other.acquire_command_buffer().unwrap();
            deformer.record(&mut cmd, vertices, &before, 0.4).unwrap();
            cmd.build_blas(&[**built], mode).unwrap();
            other.submit(cmd).unwrap();
        })));
        let bytes = ctx.serialize_blas(**blas)?;
        before_serialize_copies(None);
        assert_eq!(builds.get(), 1);
        let loaded = load(&ctx, &mine.desc(MOVING, PrimitiveOrder::Given), &bytes)?;
        check.scene("as it was", &mine.tlas_of(&ctx, &loaded)?, &mine.scene)?;
        mine.scene.models[0][0].mesh = deformed(&mesh, 0.4);
        check.scene("as it is", &mine.tlas_of(&ctx, &blas)?, &mine.scene)?;
    }
    Ok(())
}

/// Whole, in another order, split; compacted or not; and what was loaded, once more.
#[test]
fn loaded_structures_are_hit_like_built_ones() -> Result<()> {
    for (split, order) in
        [(false, PrimitiveOrder::Given), (false, PrimitiveOrder::Spatial), (true, PrimitiveOrder::Auto)]
    {
        let Some(ctx) = (if split { split_device() } else { device() }) else { return Ok(()) };
        let remapped = order != PrimitiveOrder::Given;
        if remapped && !builds_device_accel_structs(&ctx) {
            // Software BVHs are neither split nor reordered.
            continue;
        }
        let check = HitCheck::new(&ctx)?;
        let mine = Mine::new(&ctx)?;
        let desc = mine.desc(MOVING, order);
        let built = ctx.create_blas(&desc)?;
        let info = ctx.accel_struct_info(*built)?;
        assert_eq!((info.parts > 5, info.is_remapped), (split, remapped));
        let plain = ctx.serialize_blas(*built)?;
        ctx.compact(&[*built])?;
        wait_for_compaction(&ctx)?;
        assert!(matches!(ctx.accel_struct_info(*built)?.compaction, Compaction::Done { .. }));
        let compacted = ctx.serialize_blas(*built)?;
        drop(built);
        wait_for_compaction(&ctx)?;
        for (what, bytes) in [("plain", &plain), ("compacted", &compacted)] {
            let loaded = load(&ctx, &desc, bytes)?;
            let again = ctx.serialize_blas(*loaded)?;
            check.scene(&format!("{what}, {order:?}"), &mine.tlas_of(&ctx, &loaded)?, &mine.scene)?;
            drop(loaded);
            let loaded = load_or_create(&ctx, &desc, Some(&again))?;
            assert!(loaded.rejected.is_none());
            let of_loaded = ctx.accel_struct_info(*loaded.blas)?;
            assert_eq!((of_loaded.parts, of_loaded.is_remapped), (info.parts, info.is_remapped));
            check.scene(
                &format!("{what} twice, {order:?}"),
                &mine.tlas_of(&ctx, &loaded.blas)?,
                &mine.scene,
            )?;
            let progress = ctx.build_progress(&[*loaded.blas])?;
            assert_eq!((progress.built, progress.total), (1, 1), "{what}: the GPU has it");
        }
    }
    Ok(())
}

/// A refit reads the buffers of the description; so does a rebuild, where there is room for one.
#[test]
fn loaded_structures_can_be_refitted() -> Result<()> {
    for ctx in whole_and_split(MOST_PRIMITIVES) {
        let (deformer, check) = (VertexDeformer::new(&ctx)?, HitCheck::new(&ctx)?);
        let mut mine = Mine::new(&ctx)?;
        let bytes = {
            let built = ctx.create_blas(&mine.desc(MOVING, PrimitiveOrder::Spatial))?;
            ctx.serialize_blas(*built)?
        };
        let loaded = load(&ctx, &mine.desc(MOVING, PrimitiveOrder::Spatial), &bytes)?;
        let tlas = mine.tlas_of(&ctx, &loaded)?;
        for (amount, mode) in [(0.3, BuildMode::Refit), (-0.5, BuildMode::Refit), (0.3, BuildMode::Rebuild)] {
            let mesh = mine.scene.models[0][0].mesh.clone();
            let mut cmd = ctx.acquire_command_buffer()?;
            deformer.record(&mut cmd, *mine.buffers[0].vertices, &mesh, amount)?;
            cmd.build_blas(&[*loaded], mode)?;
            let model = std::slice::from_ref(&loaded);
            cmd.update_tlas(*tlas, &instances(&mine.scene.placed, model), BuildMode::Refit)?;
            ctx.submit(cmd)?;
            mine.scene.models[0][0].mesh = deformed(&mesh, amount);
            check.scene(&format!("loaded, {mode:?}"), &tlas, &mine.scene)?;
        }
        ctx.compact(&[*loaded])?;
        wait_for_compaction(&ctx)?;
        assert!(matches!(ctx.accel_struct_info(*loaded)?.compaction, Compaction::Done { .. }));
        check.scene("loaded and compacted", &tlas, &mine.scene)?;
    }
    Ok(())
}

/// Nothing was submitted in between: the question comes behind the loading.
#[test]
fn loaded_structures_may_be_compacted_at_once() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let mine = Mine::new(&ctx)?;
    let desc = mine.desc(MOVING, PrimitiveOrder::Spatial);
    let bytes = serialized(&ctx, &desc)?;
    let loaded = load(&ctx, &desc, &bytes)?;
    ctx.compact(&[*loaded])?;
    let tlas = mine.tlas_of(&ctx, &loaded)?;
    wait_for_compaction(&ctx)?;
    wait_for_compaction(&ctx)?;
    assert!(matches!(ctx.accel_struct_info(*loaded)?.compaction, Compaction::Done { .. }));
    HitCheck::new(&ctx)?.scene("compacted at once", &tlas, &mine.scene)
}

/// An acceleration structure from a larger allocation is loaded into what its bytes say: no more may be built in it than fits.
#[test]
fn structures_compacted_before_they_were_saved_are_refitted() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let (deformer, check) = (VertexDeformer::new(&ctx)?, HitCheck::new(&ctx)?);
    let mut mine = Mine::new(&ctx)?;
    let built = ctx.create_blas(&mine.desc(MOVING, PrimitiveOrder::Given))?;
    ctx.compact(&[*built])?;
    wait_for_compaction(&ctx)?;
    let bytes = ctx.serialize_blas(*built)?;
    drop(built);
    let loaded = load(&ctx, &mine.desc(MOVING, PrimitiveOrder::Given), &bytes)?;
    let tlas = mine.tlas_of(&ctx, &loaded)?;
    for mode in [BuildMode::Refit, BuildMode::Auto { max_refits: 1 }, BuildMode::Auto { max_refits: 0 }] {
        let mesh = mine.scene.models[0][0].mesh.clone();
        let mut cmd = ctx.acquire_command_buffer()?;
        deformer.record(&mut cmd, *mine.buffers[0].vertices, &mesh, 0.3)?;
        cmd.build_blas(&[*loaded], mode)?;
        let model = std::slice::from_ref(&loaded);
        cmd.update_tlas(*tlas, &instances(&mine.scene.placed, model), BuildMode::Refit)?;
        ctx.submit(cmd)?;
        mine.scene.models[0][0].mesh = deformed(&mesh, 0.3);
        check.scene(&format!("compacted, loaded, {mode:?}"), &tlas, &mine.scene)?;
    }
    Ok(())
}

#[test]
fn aabbs_are_saved_too() -> Result<()> {
    let profile = DeviceProfile { name: "small".into(), max_blas_primitives: 30, ..DeviceProfile::default() };
    for profile in [None, Some(&profile)] {
        let Some(ctx) = device_with(|desc| desc.profile = profile) else { return Ok(()) };
        let spheres = SphereModel { count: 40, step: 27 };
        let (_buffers, geometries) = spheres.aabb_geometries(&ctx)?;
        let order = PrimitiveOrder::Spatial;
        let desc = BlasDesc { geometries: &geometries, order, ..Default::default() };
        let built = ctx.create_blas(&desc)?;
        assert_eq!(ctx.accel_struct_info(*built)?.is_remapped, builds_device_accel_structs(&ctx));
        let bytes = ctx.serialize_blas(*built)?;
        drop(built);
        let model = [load(&ctx, &desc, &bytes)?];
        let placed = [Placed::new(0, Affine3A::IDENTITY)];
        let instances = instances(&placed, &model);
        let tlas = ctx.create_tlas(&TlasDesc { instances: &instances, ..Default::default() })?;
        let rays = random_rays(53, 800, Vec3::new(-1.0, -1.0, -1.0), Vec3::new(5.0, 27.0, 3.0));
        spheres.check_hits(&ctx, &tlas, &placed, &rays, "loaded AABBs", |_| ())?;
    }
    Ok(())
}

#[test]
fn damaged_bytes_are_refused_and_leave_nothing_behind() -> Result<()> {
    for ctx in whole_and_split(MOST_PRIMITIVES) {
        let mine = Mine::new(&ctx)?;
        let desc = mine.desc(MOVING, PrimitiveOrder::Spatial);
        let bytes = serialized(&ctx, &desc)?;
        wait_for_compaction(&ctx)?;
        let before = ctx.accel_memory();
        for length in [0, 1, 7, 8, 11, 27, 28, 60, bytes.len() / 2, bytes.len() - 1] {
            let reason = reason(load(&ctx, &desc, &bytes[..length]));
            assert!(!reason.is_empty(), "{length}");
        }
        let longer = [&bytes[..], &[0]].concat();
        reason(load(&ctx, &desc, &longer));
        for place in (0..bytes.len()).step_by(bytes.len() / 150) {
            let mut damaged = bytes.clone();
            damaged[place] ^= 1 << (place % 8);
            reason(load(&ctx, &desc, &damaged));
        }
        reason(load(&ctx, &desc, &vec![0x5a; 4_000]));
        wait_for_compaction(&ctx)?;
        assert_eq!(ctx.accel_memory(), before);
        drop(load(&ctx, &desc, &bytes)?);
    }
    Ok(())
}

#[test]
fn bytes_of_another_mesh_or_of_other_flags_are_refused() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let mine = Mine::new(&ctx)?;
    let order = PrimitiveOrder::Given;
    let bytes = {
        let built = ctx.create_blas(&mine.desc(MOVING, order))?;
        ctx.serialize_blas(*built)?
    };
    let refused = reason(load(&ctx, &mine.desc(BuildFlags::FAST_TRACE, order), &bytes));
    assert!(refused.contains("FAST_TRACE"), "{refused}");
    let swapped: Vec<_> = mine.geometries.iter().rev().copied().collect();
    let fewer = &mine.geometries[..1];
    let spheres = SphereModel::new(12);
    let (_buffers, boxes) = spheres.aabb_geometries(&ctx)?;
    for geometries in [&swapped[..], fewer, &boxes] {
        let desc = BlasDesc { geometries, ..mine.desc(MOVING, order) };
        let refused = reason(load(&ctx, &desc, &bytes));
        assert!(refused.contains("other geometries"), "{refused}");
    }
    let BlasGeometry::Triangles(ring) = mine.geometries[0] else { unreachable!("triangles") };
    let Some(indices) = ring.indices else { unreachable!("indices") };
    let with = |ring| [BlasGeometry::Triangles(ring), mine.geometries[1]];
    let rows = lvk::transform_rows(&Affine3A::IDENTITY);
    for other in [
        Triangles { flags: GeometryFlags::empty(), ..ring },
        Triangles { triangle_count: ring.triangle_count - 1, ..ring },
        Triangles { vertex_count: ring.vertex_count - 1, ..ring },
        Triangles { vertex_format: VertexFormat::F16x4, ..ring },
        Triangles { indices: None, ..ring },
        Triangles { indices: Some(Indices { format: IndexFormat::U32, ..indices }), ..ring },
        Triangles { transform: Some(GeometryTransform::Rows(rows)), ..ring },
    ] {
        let desc = BlasDesc { geometries: &with(other), ..mine.desc(MOVING, order) };
        let refused = reason(load(&ctx, &desc, &bytes));
        assert!(refused.contains("other geometries"), "{other:?}: {refused}");
    }
    // The addresses of the inputs are no part of the mesh.
    let moved = with(Triangles { vertex_stride: 12, ..ring });
    drop(load(&ctx, &BlasDesc { geometries: &moved, ..mine.desc(MOVING, order) }, &bytes)?);
    let stale = *ctx.create_blas(&mine.desc(MOVING, order))?;
    assert!(matches!(ctx.serialize_blas(stale), Err(Error::StaleHandle { .. })));
    let tlas = ctx.create_tlas(&TlasDesc::default())?;
    assert!(matches!(ctx.serialize_blas(*tlas), Err(Error::InvalidUsage { .. })));
    Ok(())
}

/// The bytes as the library would have written them: their length, and the checksum over everything behind the 28 bytes
/// of their head, are right again.
fn resealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let length = bytes.len() as u64;
    bytes[12..20].copy_from_slice(&length.to_le_bytes());
    let sum = bytes[28..]
        .iter()
        .fold(0xcbf2_9ce4_8422_2325_u64, |sum, byte| (sum ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3));
    bytes[20..28].copy_from_slice(&sum.to_le_bytes());
    bytes
}

/// Returns the offset of the number of parts: behind the header, flags and geometries.
fn parts_start(geometries: &[BlasGeometry]) -> usize {
    28 + 8 + 28 * geometries.len()
}

/// Returns the offset of the driver's bytes in the first part: behind the number of parts and two lengths.
fn driver_start(geometries: &[BlasGeometry]) -> usize {
    parts_start(geometries) + 4 + 16
}

/// The bytes of each part, with its lengths in front.
fn parts<'a>(bytes: &'a [u8], geometries: &[BlasGeometry]) -> Vec<&'a [u8]> {
    let mut rest = &bytes[parts_start(geometries) + 4..];
    let mut parts = Vec::new();
    while !rest.is_empty() {
        let numbers = rest[..16].as_chunks().0.iter().map(|number| u64::from_le_bytes(*number));
        let [driver, words] = numbers.collect::<Vec<_>>()[..] else { unreachable!("two numbers") };
        let (part, behind) = rest.split_at((16 + driver + 4 * words.saturating_sub(1)) as usize);
        parts.push(part);
        rest = behind;
    }
    parts
}

/// Bytes with a checksum that is right, and other parts than were written.
#[test]
fn parts_that_do_not_make_up_the_mesh_are_refused() -> Result<()> {
    for (ctx, order) in [
        (device(), PrimitiveOrder::Given),
        (device(), PrimitiveOrder::Spatial),
        (split_device(), PrimitiveOrder::Given),
    ] {
        let Some(ctx) = ctx else { return Ok(()) };
        let mine = Mine::new(&ctx)?;
        let desc = mine.desc(BuildFlags::FAST_TRACE, order);
        let bytes = serialized(&ctx, &desc)?;
        let good = parts(&bytes, &mine.geometries);
        let with = |parts: &[&[u8]]| {
            let mut made = bytes[..parts_start(&mine.geometries)].to_vec();
            made.extend((parts.len() as u32).to_le_bytes());
            made.extend(parts.concat());
            resealed(made)
        };
        assert_eq!(with(&good), bytes);
        // A software BVH is always one part: other bytes are a driver's.
        let words = if builds_device_accel_structs(&ctx) { "parts" } else { "a driver" };
        let (all_but_one, last) = (&good[..good.len() - 1], &good[good.len() - 1..]);
        for wrong in [
            &[][..],
            all_but_one,
            &[&good[..], last].concat(),
            &[all_but_one, &good[..1], &good[..1]].concat(),
        ] {
            let refused = reason(load(&ctx, &desc, &with(wrong)));
            assert!(refused.contains(words), "{} parts: {refused}", wrong.len());
        }
        drop(load(&ctx, &desc, &with(&good))?);
    }
    Ok(())
}

/// Returns the bytes of a BLAS that is built for them and destroyed.
fn serialized(ctx: &Context, desc: &BlasDesc<'_>) -> Result<Vec<u8>> {
    let built = ctx.create_blas(desc)?;
    ctx.serialize_blas(*built)
}

/// Sizes and counts in the head of the driver's own bytes that cannot be.
#[test]
fn absurd_sizes_are_refused_and_built_instead() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let mine = Mine::new(&ctx)?;
    let desc = mine.desc(BuildFlags::FAST_TRACE, PrimitiveOrder::Given);
    let bytes = serialized(&ctx, &desc)?;
    wait_for_compaction(&ctx)?;
    let before = ctx.accel_memory();
    let most = ctx.blas_sizes(&desc)?.structure_bytes;
    let (size_at, handles_at) = (driver_start(&mine.geometries) + 40, driver_start(&mine.geometries) + 48);
    for (at, number) in
        [(size_at, 0), (size_at, most + 1), (size_at, 1 << 60), (size_at, u64::MAX), (handles_at, 1)]
    {
        let mut absurd = bytes.clone();
        absurd[at..at + 8].copy_from_slice(&u64::to_le_bytes(number));
        let absurd = resealed(absurd);
        reason(load(&ctx, &desc, &absurd));
        assert!(load_or_create(&ctx, &desc, Some(&absurd))?.rejected.is_some(), "{number} at {at}");
    }
    wait_for_compaction(&ctx)?;
    assert_eq!(ctx.accel_memory().structure_bytes, before.structure_bytes);
    Ok(())
}

#[test]
fn bytes_of_another_driver_are_refused_and_built_instead() -> Result<()> {
    capture_warnings();
    let Some(ctx) = device() else { return Ok(()) };
    let mine = Mine::new(&ctx)?;
    let desc = mine.desc(BuildFlags::FAST_TRACE, PrimitiveOrder::Given);
    let bytes = serialized(&ctx, &desc)?;
    assert_eq!(resealed(bytes.clone()), bytes, "the checksum is the library's");
    let uuid = driver_start(&mine.geometries);
    let own = builds_device_accel_structs(&ctx);
    // The driver's UUID comes first, or the library's mark; what of the 16 bytes behind a UUID matters is up to the driver.
    let of_others =
        if own { "another device or driver" } else { "a driver or another version of the library" };
    for place in [uuid, uuid + 7, uuid + 15] {
        let mut foreign = bytes.clone();
        foreign[place] ^= 0x10;
        let reason = reason(load(&ctx, &desc, &resealed(foreign)));
        assert!(reason.contains(of_others), "byte {}: {reason}", place - uuid);
    }
    let mut short = bytes.clone();
    // A size, or behind the mark the root of the tree.
    short[uuid + if own { 32 } else { 32 + 8 }] ^= 0x10;
    assert!(reason(load(&ctx, &desc, &resealed(short.clone()))).contains("damaged"));
    let check = HitCheck::new(&ctx)?;
    let named = BlasDesc { debug_name: "mine again", ..desc };
    let loaded = load_or_create(&ctx, &named, Some(&resealed(short)))?;
    let rejected = loaded.rejected.map(|error| error.to_string()).unwrap_or_default();
    assert!(rejected.contains("mine again") && rejected.contains("damaged"), "{rejected}");
    let warnings = take_warnings("mine again");
    assert!(warnings.len() == 1 && warnings[0].contains("building it anew"), "{warnings:?}");
    check.scene("built instead", &mine.tlas_of(&ctx, &loaded.blas)?, &mine.scene)?;
    let without = load_or_create(&ctx, &desc, None)?;
    assert!(without.rejected.is_none());
    check.scene("built without bytes", &mine.tlas_of(&ctx, &without.blas)?, &mine.scene)?;
    // A description that is no good is no reason to build.
    let wrong = BlasDesc { geometries: &[], ..desc };
    let refused = load_or_create(&ctx, &wrong, Some(&bytes)).map(drop);
    assert!(matches!(refused, Err(Error::InvalidUsage { .. })), "{refused:?}");
    Ok(())
}
