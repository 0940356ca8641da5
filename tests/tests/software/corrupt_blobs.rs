//! Damaged, invented, empty or destroyed input of software ray queries: each gives an error or a miss. No shader
//! reads out of bounds, no traversal runs for ever, and other objects stay valid.

use lvk::glam::{Affine3A, Vec3};
use lvk::{
    Aabbs, AccelStructHandle, BlasDesc, BlasGeometry, BufferHandle, BufferUsage, BuildFlags, BuildMode,
    Context, DeviceInstances, DeviceProfile, Error, GeometryFlags, Holder, RayQueryRequest, Result, TlasDesc,
    TlasInstance, transform_rows,
};
use lvk_tests::compute::words_buffer;
use lvk_tests::hit_check::{HitCheck, rays_for};
use lvk_tests::hit_comparison::HitComparison;
use lvk_tests::meshes::Mesh;
use lvk_tests::random::Random;
use lvk_tests::ray_scene::{Layout, Part, Placed, RayScene, instances, upload_geometries, vertex_bytes};
use lvk_tests::ray_tracer::{How, MISSED, Method, RayTracer};
use lvk_tests::rays::{Ray, random_rays};
use lvk_tests::{TestDevice, device, device_with};

/// Trees of the CPU and of the GPU, that are refitted or not, over all kinds of leaves of triangles.
const FLAGS: [BuildFlags; 7] = [
    BuildFlags::FAST_TRACE,
    BuildFlags::LOW_MEMORY,
    BuildFlags::FAST_BUILD,
    BuildFlags::LOW_MEMORY.union(BuildFlags::FAST_BUILD),
    BuildFlags::FAST_TRACE.union(BuildFlags::ALLOW_UPDATE),
    BuildFlags::LOW_MEMORY.union(BuildFlags::ALLOW_UPDATE),
    BuildFlags::LOW_MEMORY.union(BuildFlags::FAST_BUILD).union(BuildFlags::ALLOW_UPDATE),
];

/// A device on which only software traces.
fn bare() -> Option<TestDevice> {
    let profile = DeviceProfile::no_ray_tracing();
    device_with(|desc| {
        desc.profile = Some(&profile);
        desc.ray_query = RayQueryRequest::Software;
    })
}

fn rays() -> Vec<Ray> {
    random_rays(19, 800, Vec3::splat(-1.5), Vec3::splat(1.5))
}

fn tlas_of(ctx: &Context, blas: AccelStructHandle) -> Result<Holder<AccelStructHandle>> {
    let instances = [TlasInstance::new(blas)];
    ctx.create_tlas(&TlasDesc { instances: &instances, ..Default::default() })
}

/// A file of an acceleration structure, taken apart.
struct File {
    bytes: Vec<u8>,
    /// Offset of the blob.
    start: usize,
}

impl File {
    fn new(bytes: &[u8]) -> Self {
        const MARK: &[u8] = b"lvk software structure, form 3\0\0";
        let at = bytes.windows(MARK.len()).position(|window| window == MARK);
        Self { bytes: bytes.to_vec(), start: at.map_or(0, |at| at + MARK.len()) }
    }

    fn word(&self, word: usize) -> u32 {
        let at = self.start + word * 4;
        u32::from_le_bytes([self.bytes[at], self.bytes[at + 1], self.bytes[at + 2], self.bytes[at + 3]])
    }

    fn words(&self) -> usize {
        (self.bytes.len() - self.start) / 4
    }

    fn set(&mut self, word: usize, value: u32) {
        let at = self.start + word * 4;
        self.bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
    }

    /// Returns the bytes with a correct checksum.
    fn sealed(mut self) -> Vec<u8> {
        const HEADER_BYTES: usize = 28;
        let step = |sum: u64, byte: &u8| (sum ^ u64::from(*byte)).wrapping_mul(0x100_0000_01B3);
        let sum = self.bytes[HEADER_BYTES..].iter().fold(0xCBF2_9CE4_8422_2325, step);
        self.bytes[HEADER_BYTES - 8..HEADER_BYTES].copy_from_slice(&sum.to_le_bytes());
        self.bytes
    }
}

/// The geometries of two shapes.
fn shapes() -> Vec<Part> {
    vec![Part::new(Mesh::torus(8), Layout::Indexed16), Part::new(Mesh::cube_grid(1), Layout::Indexed32)]
}

fn reason(result: Result<Holder<AccelStructHandle>>) -> String {
    match result {
        Err(Error::Serialized { reason, .. }) => reason,
        other => unreachable!("the bytes are no good, but {other:?}"),
    }
}

/// Their checksum is right, but places, counts and references are not.
#[test]
fn made_up_numbers_in_files_are_refused() -> Result<()> {
    let Some(ctx) = bare() else { return Ok(()) };
    let (_buffers, geometries) = upload_geometries(&ctx, &shapes())?;
    for flags in FLAGS {
        let desc = BlasDesc { geometries: &geometries, flags, ..Default::default() };
        let bytes = ctx.serialize_blas(*ctx.create_blas(&desc)?)?;
        let refuse = |what: &str, change: &dyn Fn(&mut File)| {
            let mut file = File::new(&bytes);
            change(&mut file);
            // SAFETY: only software traces, which takes made-up bytes.
            eprintln!("{flags:?}, {what}: {}", reason(unsafe { ctx.load_blas(&desc, &file.sealed()) }));
        };
        refuse("moved to an address", &|file| file.set(0, 2));
        refuse("format", &|file| file.set(0, 3));
        refuse("boxes", &|file| file.set(1, 2));
        refuse("instances", &|file| file.set(1, 3));
        refuse("root", &|file| file.set(2, 1));
        refuse("no root", &|file| file.set(2, u32::MAX));
        refuse("a leaf of too many", &|file| file.set(2, 0xffff_fff0));
        for part in [4, 5] {
            for place in [0, 1, u32::MAX, u32::MAX >> 4, file_blocks(&bytes)] {
                refuse("a place", &|file| file.set(part, place));
            }
        }
        for count in [0, 1, u32::MAX, 1 << 28] {
            refuse("number of nodes", &|file| file.set(8, count));
            refuse("number of geometries", &|file| file.set(9, count));
        }
        refuse("number of primitives", &|file| file.set(3, u32::MAX));
        refuse("bounds", &|file| file.set(13, f32::NAN.to_bits()));
        let child = if File::new(&bytes).word(0) == 0 { 4 } else { 3 };
        for node in [0, 77_777, 0x7fff_ffff] {
            refuse("a child", &|file| file.set(file.word(4) as usize * 4 + child, node));
        }
        if flags.contains(BuildFlags::LOW_MEMORY) {
            // The first leaf's words are the names of three vertices.
            for (word, name) in [(0, u32::MAX), (1, u32::MAX), (0, 0x001f_ffff)] {
                refuse("a vertex", &|file| file.set(file.word(5) as usize * 4 + word, name));
            }
            for place in [0, 1, u32::MAX, file_blocks(&bytes)] {
                refuse("vertices", &|file| file.set(6, place));
            }
        }
    }
    Ok(())
}

/// Returns the end of the blob in a file, in blocks.
fn file_blocks(bytes: &[u8]) -> u32 {
    File::new(bytes).words() as u32 / 4
}

/// Traversals, refits and rebuilds of every accepted blob end.
#[test]
fn garbage_in_files_is_refused_or_harmless() -> Result<()> {
    let Some(ctx) = bare() else { return Ok(()) };
    let (tracer, rays) = (RayTracer::new(&ctx, Method::Query)?, rays());
    let (_buffers, geometries) = upload_geometries(&ctx, &shapes())?;
    let mut random = Random::new(5);
    for flags in FLAGS {
        let desc = BlasDesc { geometries: &geometries, flags, ..Default::default() };
        let bytes = ctx.serialize_blas(*ctx.create_blas(&desc)?)?;
        let mut accepted = 0;
        for _ in 0..40 {
            let mut file = File::new(&bytes);
            let (at, from) = (random.bits() as usize % file.words(), random.bits() as usize % file.words());
            let values = [random.bits() as u32, random.bits() as u32 % 300, u32::MAX, file.word(from)];
            file.set(at, values[random.bits() as usize % values.len()]);
            // SAFETY: only software traces, which takes made-up bytes.
            let blas = match unsafe { ctx.load_blas(&desc, &file.sealed()) } {
                Ok(blas) => blas,
                Err(Error::Serialized { .. }) => continue,
                Err(error) => return Err(error),
            };
            accepted += 1;
            tracer.trace(&tlas_of(&ctx, *blas)?, &rays, How::default())?;
            if flags.contains(BuildFlags::ALLOW_UPDATE) {
                build(&ctx, *blas, BuildMode::Refit)?;
                tracer.trace(&tlas_of(&ctx, *blas)?, &rays, How::default())?;
            }
            build(&ctx, *blas, BuildMode::Rebuild)?;
        }
        assert!((1..40).contains(&accepted), "{flags:?}: {accepted} of 40 are harmless");
    }
    Ok(())
}

fn build(ctx: &Context, blas: AccelStructHandle, mode: BuildMode) -> Result<()> {
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.build_blas(&[blas], mode)?;
    ctx.submit(cmd).map(drop)
}

/// A cache folder whose files were written by another program.
#[test]
fn made_up_trees_of_a_cache_are_built_again() -> Result<()> {
    let folder = std::env::temp_dir().join(format!("lvk-made-up-trees-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    let profile = DeviceProfile::no_ray_tracing();
    for garbage in [false, true, true] {
        let made = device_with(|desc| {
            desc.profile = Some(&profile);
            desc.ray_query = RayQueryRequest::Software;
            desc.tree_cache = Some(&folder);
        });
        let Some(ctx) = made else { return Ok(()) };
        let files = || std::fs::read_dir(&folder).into_iter().flatten().flatten().map(|file| file.path());
        for path in files().filter(|_| garbage) {
            assert!(std::fs::write(&path, vec![0x5a; 4_000]).is_ok());
        }
        let scene = RayScene { models: vec![shapes()], placed: vec![Placed::new(0, Affine3A::IDENTITY)] };
        HitCheck::new(&ctx)?.scene("trees of a cache", &scene.upload(&ctx)?.tlas, &scene)?;
        assert_eq!(files().count(), 1);
    }
    assert!(std::fs::remove_dir_all(&folder).is_ok());
    Ok(())
}

/// A torus with triangles among its own whose indices are beyond the vertices, and the same with points instead.
fn with_bad_indices() -> [Mesh; 2] {
    let whole = Mesh::torus(9);
    let count = whole.positions.len() as u32;
    let [mut bad, mut good] = [whole.clone(), whole];
    for index in (0..bad.triangles.len()).filter(|index| index % 4 == 1) {
        let beyond = [count, 0xffff, count + 7][index % 3];
        bad.triangles[index][index % 3] = beyond;
        good.triangles[index] = [0; 3];
    }
    [bad, good]
}

/// The same with corners that are not numbers, or not finite.
fn with_bad_vertices() -> [Mesh; 2] {
    let whole = Mesh::torus(9).unshared();
    let [mut bad, mut good] = [whole.clone(), whole];
    for index in (0..bad.triangles.len()).filter(|index| index % 4 == 1) {
        let [a, ..] = bad.triangles[index];
        let none = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][index % 3];
        bad.positions[a as usize][index % 2] = none;
        good.triangles[index] = [0; 3];
    }
    [bad, good]
}

#[test]
fn degenerate_triangles_are_not_hit_and_change_no_other_hit() -> Result<()> {
    let Some(ctx) = bare() else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    for flags in FLAGS {
        for ([bad, good], layouts) in [
            (with_bad_indices(), [Layout::Indexed16, Layout::Indexed32]),
            (with_bad_vertices(), [Layout::Unshared, Layout::Interleaved]),
        ] {
            for layout in layouts {
                let scene = |mesh: &Mesh| RayScene {
                    models: vec![vec![
                        Part::new(mesh.clone(), layout),
                        Part::new(Mesh::cube_grid(1), layout),
                    ]],
                    placed: vec![Placed::new(0, Affine3A::IDENTITY)],
                };
                let gpu = scene(&bad).upload_with(&ctx, flags, BuildFlags::default(), 0)?;
                check.scene(&format!("bad, {layout:?}, {flags:?}"), &gpu.tlas, &scene(&good))?;
            }
        }
    }
    Ok(())
}

/// Vertices go and come back between refits, some of them or all.
#[test]
fn vertices_may_become_nan_and_finite_again() -> Result<()> {
    let Some(ctx) = bare() else { return Ok(()) };
    let (check, rays) = (HitCheck::new(&ctx)?, rays());
    let tracer = RayTracer::new(&ctx, Method::Query)?;
    for flags in FLAGS.into_iter().filter(|flags| flags.contains(BuildFlags::ALLOW_UPDATE)) {
        let [bad, good] = with_bad_vertices();
        let whole = Mesh::torus(9).unshared();
        let mut none = whole.clone();
        none.positions.iter_mut().for_each(|position| *position = [f32::NAN; 3]);
        let mut scene = RayScene::single(whole.clone(), Layout::Unshared);
        let gpu = scene.upload_with(&ctx, flags, BuildFlags::default(), 0)?;
        for (contents, shown) in
            [(&bad, Some(&good)), (&none, None), (&whole, Some(&whole)), (&bad, Some(&good))]
        {
            let vertices = *gpu.buffers[0].vertices;
            ctx.upload_buffer(vertices, 0, &vertex_bytes(contents, Layout::Unshared))?;
            let mut cmd = ctx.acquire_command_buffer()?;
            cmd.build_blas(&[*gpu.models[0]], BuildMode::Refit)?;
            cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), BuildMode::Rebuild)?;
            ctx.submit(cmd)?;
            match shown {
                Some(mesh) => {
                    scene.models[0][0].mesh = mesh.clone();
                    check.scene(&format!("vertices, {flags:?}"), &gpu.tlas, &scene)?;
                }
                None => expect_nothing(&tracer, &gpu.tlas, &rays, "no vertices")?,
            }
        }
    }
    Ok(())
}

fn expect_nothing(
    tracer: &RayTracer,
    tlas: &Holder<AccelStructHandle>,
    rays: &[Ray],
    what: &str,
) -> Result<()> {
    let records = tracer.trace(tlas, rays, How::default())?;
    assert!(records.iter().all(|record| record.kind == MISSED), "{what}");
    Ok(())
}

#[test]
fn nothing_is_not_hit() -> Result<()> {
    let Some(ctx) = bare() else { return Ok(()) };
    let (tracer, rays) = (RayTracer::new(&ctx, Method::Query)?, rays());
    let empty = ctx.create_tlas(&TlasDesc { capacity: 5, ..Default::default() })?;
    expect_nothing(&tracer, &empty, &rays, "never given an instance")?;
    let nothing = Mesh { positions: Vec::new(), triangles: Vec::new() };
    let mut points = Mesh::torus(6);
    points.positions.iter_mut().for_each(|position| *position = [f32::NAN; 3]);
    for flags in FLAGS {
        for mesh in [&nothing, &points] {
            for parts in [1, 2] {
                let parts = vec![Part::new(mesh.clone(), Layout::Indexed32); parts];
                let (_buffers, geometries) = upload_geometries(&ctx, &parts)?;
                let desc = BlasDesc { geometries: &geometries, flags, ..Default::default() };
                let blas = ctx.create_blas(&desc)?;
                expect_nothing(&tracer, &tlas_of(&ctx, *blas)?, &rays, "nothing")?;
                // SAFETY: `serialize_blas` returned the bytes.
                let loaded = unsafe { ctx.load_blas(&desc, &ctx.serialize_blas(*blas)?) }?;
                if flags.contains(BuildFlags::ALLOW_UPDATE) {
                    build(&ctx, *loaded, BuildMode::Refit)?;
                }
                expect_nothing(&tracer, &tlas_of(&ctx, *loaded)?, &rays, "nothing from a file")?;
                build(&ctx, *loaded, BuildMode::Rebuild)?;
                expect_nothing(&tracer, &tlas_of(&ctx, *loaded)?, &rays, "nothing built again")?;
            }
        }
    }
    Ok(())
}

/// AABBs that are inverted, not numbers, or without end.
#[test]
fn aabbs_of_nothing_are_not_hit() -> Result<()> {
    let Some(ctx) = bare() else { return Ok(()) };
    let tracer = RayTracer::new(&ctx, Method::Query)?;
    let boxes = [
        [1.0, 0.0, 0.0, -1.0, 1.0, 1.0],
        [f32::NAN, 0.0, 0.0, 1.0, 1.0, 1.0],
        [0.0, 0.0, 0.0, 1.0, f32::NAN, 1.0],
        [f32::INFINITY; 6],
    ];
    let data = Some(bytemuck::cast_slice(&boxes));
    let usage = BufferUsage::ACCEL_INPUT;
    let buffer = ctx.create_buffer(&lvk::BufferDesc { data, usage, ..Default::default() })?;
    let geometries = [BlasGeometry::Aabbs(Aabbs {
        buffer: *buffer,
        offset: 0,
        stride: 0,
        count: boxes.len() as u32,
        flags: GeometryFlags::OPAQUE,
    })];
    for flags in FLAGS {
        let blas = ctx.create_blas(&BlasDesc { geometries: &geometries, flags, ..Default::default() })?;
        expect_nothing(&tracer, &tlas_of(&ctx, *blas)?, &rays(), "boxes")?;
    }
    Ok(())
}

/// Rays without place, direction or length, or with endless ones.
#[test]
fn rays_of_garbage_come_to_an_end() -> Result<()> {
    let Some(ctx) = bare() else { return Ok(()) };
    let tracer = RayTracer::new(&ctx, Method::Query)?;
    let none = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    let mut rays = vec![Ray { direction: [0.0; 3], ..Ray::new(Vec3::ZERO, Vec3::X) }];
    for number in none {
        for axis in 0..3 {
            let mut ray = Ray::new(Vec3::Z * 0.1, Vec3::ONE);
            ray.origin[axis] = number;
            rays.push(ray);
            let mut ray = Ray::new(Vec3::Z * 0.1, Vec3::ONE);
            ray.direction[axis] = number;
            rays.push(ray);
        }
    }
    rays.extend([f32::NAN, -1.0].map(|t_max| Ray { t_max, ..Ray::new(Vec3::ZERO, Vec3::X) }));
    rays.extend([f32::NAN, -f32::NAN].map(|t_min| Ray { t_min, ..Ray::new(Vec3::ZERO, Vec3::X) }));
    let opaque = shapes();
    let mut glass = shapes();
    glass.iter_mut().for_each(|part| part.flags = GeometryFlags::empty());
    for parts in [opaque, glass] {
        for flags in FLAGS {
            let scene =
                RayScene { models: vec![parts.clone()], placed: vec![Placed::new(0, Affine3A::IDENTITY)] };
            let gpu = scene.upload_with(&ctx, flags, BuildFlags::default(), 0)?;
            expect_nothing(&tracer, &gpu.tlas, &rays, "garbage")?;
        }
    }
    Ok(())
}

const RECORD_WORDS: usize = 16;

/// A record that shows an acceleration structure by its place in the list.
fn record(placed: &Placed, place: [u32; 2]) -> Vec<u32> {
    let rows = transform_rows(&placed.transform).map(f32::to_bits);
    let numbers = [placed.custom_index | u32::from(placed.mask) << 24, 0, place[0], place[1]];
    [&rows[..], &numbers].concat()
}

/// Returns invalid instances: zeros, ones, BLAS numbers out of range, singular and NaN matrices, and one with a NaN
/// AABB.
fn garbage(number: u32) -> Vec<u32> {
    let whole = Placed::new(0, Affine3A::IDENTITY);
    let mut words = record(&whole, [0, 0]);
    let rows = |words: &mut Vec<u32>, of: &dyn Fn(usize) -> f32| {
        (0..12).for_each(|row| words[row] = of(row).to_bits());
    };
    // The shape becomes flat, amid the others.
    let flat = |row: usize| [1.0, 2.0, 3.0, 9.0, 4.0, 5.0, 6.0, -30.0, 7.0, 8.0, 9.0, -60.0][row];
    let tenths = |row: usize| flat(row) * 0.1;
    match number % 11 {
        0 => return vec![0; RECORD_WORDS],
        1 => return vec![u32::MAX; RECORD_WORDS],
        2 => words[14] = 1,
        3 => words[14] = u32::MAX,
        4 => words[15] = 1,
        5 => rows(&mut words, &|_| f32::NAN),
        6 => rows(&mut words, &|_| f32::INFINITY),
        7 => rows(&mut words, &flat),
        8 => rows(&mut words, &|row| if row % 5 == 0 { 3e38 } else { 0.0 }),
        9 => rows(&mut words, &tenths),
        _ => words[12] = 0,
    }
    words
}

/// Few, which one workgroup builds, and many.
#[test]
fn garbage_in_buffers_of_instances_is_not_hit_and_changes_no_other_hit() -> Result<()> {
    let Some(ctx) = bare() else { return Ok(()) };
    let check = HitCheck::new(&ctx)?;
    // Far from its own origin, so that the largest matrix makes more of it than numbers can say.
    let far = Part { transform: Some(Affine3A::from_translation(Vec3::X * 9.0)), ..shapes().remove(0) };
    for flags in [BuildFlags::FAST_TRACE, BuildFlags::FAST_BUILD] {
        for count in [24, 3_000] {
            let mut scene = RayScene { models: vec![vec![far.clone()]], placed: Vec::new() };
            let mut words = Vec::new();
            for number in 0..count {
                let to = Vec3::new((number % 7) as f32, (number % 5) as f32, (number % 3) as f32) * 3.0;
                let mut placed =
                    Placed { custom_index: number, ..Placed::new(0, Affine3A::from_translation(to)) };
                if number % (count / 12) == 1 {
                    words.extend(record(&placed, [0, 0]));
                } else {
                    words.extend(garbage(number));
                    placed.mask = 0;
                }
                scene.placed.push(placed);
            }
            let empty = RayScene { placed: Vec::new(), ..scene.clone() };
            let gpu = empty.upload_with(&ctx, flags, BuildFlags::default(), count)?;
            let records = words_buffer(&ctx, &words);
            update_from(&ctx, *gpu.tlas, *records, count, &[*gpu.models[0]])?;
            check.scene(&format!("{count} records, {flags:?}"), &gpu.tlas, &scene)?;
        }
    }
    Ok(())
}

fn update_from(
    ctx: &Context,
    tlas: AccelStructHandle,
    buffer: BufferHandle,
    count: u32,
    blas: &[AccelStructHandle],
) -> Result<()> {
    let mut cmd = ctx.acquire_command_buffer()?;
    let source = DeviceInstances { buffer, offset: 0, count, blas };
    cmd.update_tlas_from_buffer(tlas, &source, BuildMode::Rebuild)?;
    ctx.submit(cmd).map(drop)
}

/// A BLAS lives as long as a TLAS references it. A destroyed BLAS cannot be referenced again, by the host or by a
/// buffer.
#[test]
fn destroyed_accel_structs_are_refused() -> Result<()> {
    let Some(ctx) = bare() else { return Ok(()) };
    let scene = RayScene { models: vec![shapes()], placed: vec![Placed::new(0, Affine3A::IDENTITY)] };
    let mut gpu = scene.upload(&ctx)?;
    let (check, gone) = (HitCheck::new(&ctx)?, *gpu.models[0]);
    let records = words_buffer(&ctx, &record(&scene.placed[0], [0, 0]));
    gpu.models.clear();
    ctx.wait_idle()?;
    let refused = update_from(&ctx, *gpu.tlas, *records, 1, &[gone]);
    assert!(matches!(refused, Err(Error::StaleHandle { .. })), "{refused:?}");
    let mut cmd = ctx.acquire_command_buffer()?;
    let refused = cmd.update_tlas(*gpu.tlas, &[TlasInstance::new(gone)], BuildMode::Rebuild);
    assert!(matches!(refused, Err(Error::StaleHandle { .. })), "{refused:?}");
    drop(cmd);
    let _others = scene.upload(&ctx)?;
    check.scene("shown by one that is gone", &gpu.tlas, &scene)?;
    // Nothing of the list is there any more.
    update_from(&ctx, *gpu.tlas, *records, 1, &[])?;
    expect_nothing(&RayTracer::new(&ctx, Method::Query)?, &gpu.tlas, &rays(), "an empty list")
}

/// The slot of a destroyed acceleration structure holds the empty one, and then that of its next owner, whatever the
/// memory contains.
#[test]
fn a_destroyed_tlas_is_never_hit() -> Result<()> {
    for ctx in [bare(), device(), device_with(|desc| desc.ray_query = RayQueryRequest::Software)] {
        let Some(ctx) = ctx else { return Ok(()) };
        for method in Method::available(&ctx) {
            let tracer = RayTracer::new(&ctx, method)?;
            let scene = RayScene { models: vec![shapes()], placed: vec![Placed::new(0, Affine3A::IDENTITY)] };
            let gpu = scene.upload(&ctx)?;
            let (reference, slot) = (scene.reference(), gpu.tlas.index());
            let rays = rays_for(&reference);
            let trace = || {
                let trace_buffers = tracer.buffers(&rays)?;
                let mut cmd = ctx.acquire_command_buffer()?;
                tracer.record_at(&mut cmd, slot, &trace_buffers, How::default())?;
                ctx.submit(cmd)?;
                tracer.read(&trace_buffers)
            };
            let hits = |what: &str| -> Result<()> {
                HitComparison::of_triangles(&rays, &trace()?, |ray| reference.closest(ray, 0xff))
                    .assert(what);
                Ok(())
            };
            hits("as long as it is there")?;
            drop(gpu);
            ctx.wait_idle()?;
            let garbage = words_buffer(&ctx, &vec![0x3f80_0000; 1 << 16]);
            assert!(trace()?.iter().all(|record| record.kind == MISSED), "it is gone");
            drop(garbage);
            let again = scene.upload(&ctx)?;
            assert_eq!(again.tlas.index(), slot);
            hits("taken again")?;
            // In one go: freed, taken, filled.
            drop(again);
            ctx.wait_idle()?;
            let again = scene.upload(&ctx)?;
            assert_eq!(again.tlas.index(), slot);
            hits("taken at once")?;
        }
    }
    Ok(())
}
