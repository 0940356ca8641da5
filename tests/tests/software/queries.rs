//! Ray queries by the library's own traversal: on devices without ray tracing, and beside the device's own.

use lvk::glam::{Affine3A, Quat, Vec3};
use lvk::{
    BlasDesc, BuildFlags, BuildMode, ComputePipelineDesc, Context, DeviceProfile, Error, GeometryFlags,
    RayQueryPath, RayQueryRequest, Result, ShaderStage, TlasDesc, TlasInstance,
};
use lvk_tests::gpu_built::uneven_triangles;
use lvk_tests::hit_comparison::HitComparison;
use lvk_tests::meshes::Mesh;
use lvk_tests::random::Random;
use lvk_tests::ray_scene::{BUILD_FLAGS, Layout, Part, Placed, RayScene, instances, upload_geometries};
use lvk_tests::ray_tracer::{HitRecord, How, MISSED, Method, OPAQUE, RayTracer, shader};
use lvk_tests::rays::{Ray, random_rays};
use lvk_tests::subprocess::on_swiftshader;
use lvk_tests::{TestDevice, device, device_with};

fn software() -> Option<TestDevice> {
    device_with(|desc| desc.ray_query = RayQueryRequest::Software)
}

/// Shapes of two geometries, turned, stretched and mirrored, over each other.
fn crowd() -> RayScene {
    let mut random = Random::new(77);
    let glass = |mesh| Part { flags: GeometryFlags::empty(), ..Part::new(mesh, Layout::Indexed32) };
    let models = vec![
        vec![Part::new(Mesh::torus(9), Layout::Indexed16), glass(Mesh::cube_grid(2))],
        vec![Part::new(Mesh::terrain(12), Layout::Unshared)],
        vec![Part::new(Mesh::cube_grid(1), Layout::Interleaved)],
    ];
    let mut place = |index: u32| {
        let scale = Vec3::new(random.between(0.3, 1.5), random.between(-1.5, -0.3), random.between(0.3, 1.5));
        let turn = Quat::from_axis_angle(random.direction(), random.between(0.0, 6.0));
        let to = random.direction() * random.between(0.0, 2.0);
        let transform = Affine3A::from_scale_rotation_translation(scale, turn, to);
        Placed { custom_index: 1000 + index, ..Placed::new(index as usize % 3, transform) }
    };
    RayScene { placed: (0..40).map(&mut place).collect(), models }
}

fn check_crowd(ctx: &Context, flags: BuildFlags, rays: usize) -> Result<()> {
    let scene = crowd();
    let gpu = scene.upload_with(ctx, flags, BuildFlags::default(), 0)?;
    let reference = scene.reference();
    let rays = random_rays(5, rays, Vec3::splat(-2.0), Vec3::splat(2.0));
    let records = RayTracer::new(ctx, Method::Query)?.trace(&gpu.tlas, &rays, How::default())?;
    HitComparison::of_triangles(&rays, &records, |ray| reference.closest(ray, 0xff))
        .assert(&format!("a crowd with {flags:?}"));
    let shadows = RayTracer::new(ctx, Method::Query)?.trace(&gpu.tlas, &rays, How::shadows())?;
    HitComparison::of_occlusion(&rays, &shadows, |ray| reference.occluded(ray, 0xff))
        .assert(&format!("shadows of a crowd with {flags:?}"));
    Ok(())
}

/// A device without any ray tracing of its own.
fn bare_device(ray_query: RayQueryRequest) -> Option<TestDevice> {
    let profile = DeviceProfile::no_ray_tracing();
    device_with(|desc| {
        desc.profile = Some(&profile);
        desc.ray_query = ray_query;
    })
}

#[test]
fn every_kind_of_build_is_hit_as_the_reference_says() -> Result<()> {
    let Some(ctx) = software() else { return Ok(()) };
    assert_eq!(ctx.capabilities().ray_query_path, RayQueryPath::Software);
    BUILD_FLAGS.into_iter().try_for_each(|flags| check_crowd(&ctx, flags, 3_000))
}

#[test]
fn a_device_without_accel_structs_of_its_own_has_everything() -> Result<()> {
    let Some(ctx) = bare_device(RayQueryRequest::Auto) else { return Ok(()) };
    let caps = ctx.capabilities();
    assert!(caps.ray_query && !caps.ray_tracing_pipeline && !caps.ray_query_reason.is_empty());
    assert_eq!(caps.ray_query_path, RayQueryPath::Software);
    BUILD_FLAGS.into_iter().try_for_each(|flags| check_crowd(&ctx, flags, 1_000))
}

#[test]
fn a_driver_without_ray_tracing_traces() {
    on_swiftshader(a_driver_without_ray_tracing_traces, || {
        let Some(ctx) = device_with(|desc| desc.ray_query = RayQueryRequest::Auto) else { return };
        assert!(ctx.capabilities().device_name.contains("SwiftShader"));
        for flags in BUILD_FLAGS {
            if let Err(error) = check_crowd(&ctx, flags, 600) {
                unreachable!("{flags:?}: {error}");
            }
        }
    });
}

#[test]
fn software_and_the_device_give_the_same_hits() -> Result<()> {
    let (Some(one), Some(other)) = (device(), software()) else { return Ok(()) };
    if one.capabilities().ray_query_path != RayQueryPath::Hardware {
        eprintln!("NOT TESTED, {} has no ray queries", one.capabilities().device_name);
        return Ok(());
    }
    let rays = random_rays(6, 20_000, Vec3::splat(-2.0), Vec3::splat(2.0));
    let trace = |ctx: &Context| -> Result<Vec<HitRecord>> {
        let gpu = crowd().upload(ctx)?;
        RayTracer::new(ctx, Method::Query)?.trace(&gpu.tlas, &rays, How::default())
    };
    let (one, other) = (trace(&one)?, trace(&other)?);
    let ids = |record: &HitRecord| (record.kind, record.instance, record.geometry, record.primitive);
    let differ = one.iter().zip(&other).filter(|(one, other)| ids(one) != ids(other)).count();
    assert!(differ * 2_000 < rays.len(), "{differ} of {} rays differ", rays.len());
    Ok(())
}

/// Modules that declare opaque triangles alone, by the library and by the device.
#[test]
fn modules_without_candidates_see_the_same() -> Result<()> {
    let (Some(one), Some(other)) = (device(), software()) else { return Ok(()) };
    let rays = random_rays(8, 5_000, Vec3::splat(-2.0), Vec3::splat(2.0));
    for ctx in [one, other].iter().filter(|ctx| ctx.capabilities().ray_query) {
        let gpu = crowd().upload(ctx)?;
        let (tracer, plain) = (RayTracer::for_opaque_triangles(ctx)?, RayTracer::new(ctx, Method::Query)?);
        let opaque = |how: How| How { flags: how.flags | OPAQUE, ..how };
        let found = tracer.trace(&gpu.tlas, &rays, How::default())?;
        let path = ctx.capabilities().ray_query_path;
        assert_eq!(found, plain.trace(&gpu.tlas, &rays, opaque(How::default()))?, "{path:?}");
        let missed = |records: Vec<HitRecord>| records.iter().map(|it| it.kind == MISSED).collect::<Vec<_>>();
        let found = missed(tracer.trace(&gpu.tlas, &rays, How::shadows())?);
        assert_eq!(found, missed(plain.trace(&gpu.tlas, &rays, opaque(How::shadows()))?), "{path:?}");
    }
    Ok(())
}

/// Two queries that take turns, each with candidates of its own.
const TURNS: &str = r#"
    #include <lvk/ray_query.glsl>
    #include "ray_records.glsl"
    layout(local_size_x = 64) in;

    uint tag(uint instance, uint primitive) { return (instance * 7919u + primitive * 104729u) % 65521u; }

    void main() {
        uint index = gl_GlobalInvocationID.x;
        if (index >= count) return;
        Ray one = rays.at[index];
        Ray two = rays.at[count - 1u - index];
        LvkRayQuery a, b;
        lvkRayQueryInitialize(a, tlas, flags, mask, one.origin, one.tMin, one.direction, one.tMax);
        lvkRayQueryInitialize(b, tlas, flags, mask, two.origin, two.tMin, two.direction, two.tMax);
        uint sumA = 0u, sumB = 0u, seenA = 0u, seenB = 0u;
        bool goesA = true, goesB = true;
        while (goesA || goesB) {
            if (goesA) goesA = lvkRayQueryProceed(a);
            if (goesA) {
                sumA += tag(lvkRayQueryInstanceId(a, LVK_CANDIDATE, tlas), lvkRayQueryPrimitiveIndex(a, LVK_CANDIDATE, tlas));
                seenA += 1u;
            }
            if (goesB && ALTERNATE(index)) {
                goesB = lvkRayQueryProceed(b);
                if (goesB) {
                    sumB += tag(lvkRayQueryInstanceId(b, LVK_CANDIDATE, tlas), lvkRayQueryPrimitiveIndex(b, LVK_CANDIDATE, tlas));
                    seenB += 1u;
                }
            }
        }
        HitRecord record = kNoHit;
        record.instance = sumA;
        record.customIndex = seenA;
        record.geometry = sumB;
        record.primitive = seenB;
        hits.at[index] = record;
    }"#;

#[test]
fn queries_that_take_turns_do_not_disturb_each_other() -> Result<()> {
    let Some(ctx) = software() else { return Ok(()) };
    let scene = {
        let mut scene = crowd();
        scene.models.iter_mut().flatten().for_each(|part| part.flags = GeometryFlags::NO_DUPLICATE_ANY_HIT);
        scene
    };
    let gpu = scene.upload(&ctx)?;
    let rays = random_rays(8, 2_000, Vec3::splat(-2.0), Vec3::splat(2.0));
    let records = |when: &str| -> Result<Vec<HitRecord>> {
        let text = TURNS.replace("ALTERNATE(index)", when);
        let module = shader(&ctx, ShaderStage::Compute, &text)?;
        let desc = ComputePipelineDesc { module: Some(*module), ..Default::default() };
        let tracer = RayTracer::from_query(&ctx, ctx.create_compute_pipeline(&desc)?);
        tracer.trace(&gpu.tlas, &rays, How::default())
    };
    let (in_turns, one_after_the_other) = (records("true")?, records("!goesA")?);
    for (index, (one, other)) in in_turns.iter().zip(&one_after_the_other).enumerate() {
        let numbers = |of: &HitRecord| [of.instance, of.custom_index, of.geometry, of.primitive];
        assert_eq!(numbers(one), numbers(other), "ray {index}");
        let back = &in_turns[rays.len() - 1 - index];
        assert_eq!((one.instance, one.custom_index), (back.geometry, back.primitive), "ray {index}");
    }
    assert!(in_turns.iter().any(|record| record.custom_index > 3), "there are candidates");
    Ok(())
}

/// A query that is given up with a candidate waiting, or terminated, and begins anew with another ray.
const ANEW: &str = r#"
    #include <lvk/ray_query.glsl>
    #include "ray_records.glsl"
    layout(local_size_x = 64) in;

    void main() {
        uint index = gl_GlobalInvocationID.x;
        if (index >= count) return;
        Ray one = rays.at[index];
        Ray two = rays.at[count - 1u - index];
        LvkRayQuery query;
        lvkRayQueryInitialize(query, tlas, flags, mask, two.origin, two.tMin, two.direction, two.tMax);
        for (uint turn = 0u; turn < TURNS(index) && lvkRayQueryProceed(query); ++turn) {
            lvkRayQueryConfirmIntersection(query);
        }
        if (index % 3u == 0u) lvkRayQueryTerminate(query);
        lvkRayQueryInitialize(query, tlas, flags, mask, one.origin, one.tMin, one.direction, one.tMax);
        uint seen = 0u;
        while (lvkRayQueryProceed(query)) {
            seen += 1u;
            if (lvkRayQueryPrimitiveIndex(query, LVK_CANDIDATE, tlas) % 2u == 0u) lvkRayQueryConfirmIntersection(query);
        }
        HitRecord record = kNoHit;
        record.customIndex = seen;
        if (lvkRayQueryType(query, LVK_COMMITTED) != 0u) {
            record.t = lvkRayQueryT(query, LVK_COMMITTED);
            record.instance = lvkRayQueryInstanceId(query, LVK_COMMITTED, tlas);
            record.primitive = lvkRayQueryPrimitiveIndex(query, LVK_COMMITTED, tlas);
        }
        hits.at[index] = record;
    }"#;

#[test]
fn a_query_may_begin_anew_wherever_it_was() -> Result<()> {
    let Some(ctx) = software() else { return Ok(()) };
    let mut scene = crowd();
    scene.models.iter_mut().flatten().for_each(|part| part.flags = GeometryFlags::NO_DUPLICATE_ANY_HIT);
    let gpu = scene.upload(&ctx)?;
    let rays = random_rays(9, 2_000, Vec3::splat(-2.0), Vec3::splat(2.0));
    let records = |turns: &str| -> Result<Vec<HitRecord>> {
        let module = shader(&ctx, ShaderStage::Compute, &ANEW.replace("TURNS(index)", turns))?;
        let desc = ComputePipelineDesc { module: Some(*module), ..Default::default() };
        let tracer = RayTracer::from_query(&ctx, ctx.create_compute_pipeline(&desc)?);
        tracer.trace(&gpu.tlas, &rays, How::default())
    };
    let fresh = records("0u")?;
    assert!(fresh.iter().any(|record| record.custom_index > 3), "there are candidates");
    assert_eq!(fresh, records("(index % 5u)")?, "after some candidates");
    assert_eq!(fresh, records("1000u")?, "after all");
    Ok(())
}

#[test]
fn an_accel_struct_is_the_same_after_a_file() -> Result<()> {
    let Some(ctx) = bare_device(RayQueryRequest::Software) else { return Ok(()) };
    let parts = [Part::new(Mesh::torus(12), Layout::Indexed16)];
    let (_buffers, geometries) = upload_geometries(&ctx, &parts)?;
    let rays = random_rays(9, 2_000, Vec3::splat(-1.5), Vec3::splat(1.5));
    let tracer = RayTracer::new(&ctx, Method::Query)?;
    for flags in BUILD_FLAGS {
        let desc = BlasDesc { geometries: &geometries, flags, ..Default::default() };
        let built = ctx.create_blas(&desc)?;
        let bytes = ctx.serialize_blas(*built)?;
        // SAFETY: `serialize_blas` returned the bytes.
        let loaded = unsafe { ctx.load_blas(&desc, &bytes) }?;
        let trace = |blas| {
            let instances = [TlasInstance::new(blas)];
            let tlas = ctx.create_tlas(&TlasDesc { instances: &instances, ..Default::default() })?;
            tracer.trace(&tlas, &rays, How::default())
        };
        assert_eq!(trace(*built)?, trace(*loaded)?, "{flags:?}");
        let mut damaged = bytes.clone();
        damaged[bytes.len() / 2] ^= 4;
        // SAFETY: they were damaged, not made up.
        let refused = unsafe { ctx.load_blas(&desc, &damaged) };
        assert!(matches!(refused, Err(Error::Serialized { .. })), "{refused:?}");
    }
    Ok(())
}

/// A BLAS without memory for compact nodes gets full ones: rays hit the same, from a file too.
#[test]
fn uneven_trees_are_hit_as_even_ones() -> Result<()> {
    let Some(ctx) = bare_device(RayQueryRequest::Software) else { return Ok(()) };
    let positions: Vec<_> = uneven_triangles(8).into_iter().flatten().collect();
    let triangles =
        (0..positions.len() as u32 / 3).map(|number| [0, 1, 2].map(|step| number * 3 + step)).collect();
    let parts = [Part::new(Mesh { positions, triangles }, Layout::Indexed32)];
    let (_buffers, geometries) = upload_geometries(&ctx, &parts)?;
    let rays = random_rays(5, 2_000, Vec3::splat(-1.0), Vec3::splat(9.0));
    let tracer = RayTracer::new(&ctx, Method::Query)?;
    let trace = |blas| -> Result<Vec<f32>> {
        let instances = [TlasInstance::new(blas)];
        let tlas = ctx.create_tlas(&TlasDesc { instances: &instances, ..Default::default() })?;
        let found = tracer.trace(&tlas, &rays, How::default())?;
        Ok(found.iter().map(|it| if it.kind == MISSED { -1.0 } else { it.t }).collect())
    };
    let of_cpu = trace(*ctx.create_blas(&BlasDesc { geometries: &geometries, ..Default::default() })?)?;
    assert!(of_cpu.iter().filter(|t| **t > 0.0).count() > 500);
    let close = |found: &[f32]| found.iter().zip(&of_cpu).all(|(a, b)| (a - b).abs() < 1e-4);
    for more in [BuildFlags::ALLOW_UPDATE, BuildFlags::LOW_MEMORY] {
        let desc =
            BlasDesc { geometries: &geometries, flags: BuildFlags::FAST_BUILD | more, ..Default::default() };
        let built = ctx.create_blas(&desc)?;
        assert!(close(&trace(*built)?), "{more:?}");
        let bytes = ctx.serialize_blas(*built)?;
        // SAFETY: `serialize_blas` returned the bytes.
        let loaded = unsafe { ctx.load_blas(&desc, &bytes) }?;
        assert!(close(&trace(*loaded)?), "{more:?}, from a file");
    }
    Ok(())
}

/// Returns three triangles side by side, whose vertices are far apart in a list of `count` vertices, and `points`
/// degenerate ones.
fn among_many(count: usize, points: u32) -> Mesh {
    let named = [[0, 1 << 11, count - 1], [count - 2, 5, 1 << 20], [count / 2 + 1, count - 3, (1 << 11) - 1]];
    let mut positions = vec![[0.0; 3]; count];
    for (at, corners) in (0_u8..).zip(named) {
        for (corner, offset) in corners.into_iter().zip([Vec3::ZERO, Vec3::X, Vec3::Y]) {
            positions[corner] = (Vec3::X * f32::from(at) * 10.0 + offset).to_array();
        }
    }
    let triangles = named.map(|corners| corners.map(|corner| corner as u32)).into_iter();
    Mesh { positions, triangles: triangles.chain((0..points).map(|_| [6; 3])).collect() }
}

/// Leaves are packed up to 2^21 vertices, and not beyond. Builds of the GPU copy those that no triangle names too, where there
/// are enough triangles for that; those of the CPU do not.
#[test]
fn the_last_of_many_vertices_are_hit() -> Result<()> {
    let Some(ctx) = software() else { return Ok(()) };
    let tracer = RayTracer::new(&ctx, Method::Query)?;
    let ray =
        |at: f32| Ray { origin: [at + 0.25, 0.25, 1.0], t_min: 0.0, direction: [0.0, 0.0, -1.0], t_max: 9.0 };
    let rays = [0.0, 10.0, 20.0, 30.0].map(ray);
    for count in [1 << 21, (1 << 21) + 1] {
        for (more, points) in
            [(BuildFlags::FAST_BUILD, 0), (BuildFlags::FAST_BUILD, 800_000), (BuildFlags::ALLOW_UPDATE, 0)]
        {
            let parts = [Part::new(among_many(count, points), Layout::Indexed32)];
            let (_buffers, geometries) = upload_geometries(&ctx, &parts)?;
            let flags = BuildFlags::LOW_MEMORY | more;
            let blas = ctx.create_blas(&BlasDesc { geometries: &geometries, flags, ..Default::default() })?;
            let copied = ctx.accel_struct_sizes(*blas)?.structure_bytes >= count as u64 * 12;
            assert_eq!(copied, points > 0, "{count} vertices, {flags:?}");
            let instances = [TlasInstance::new(*blas)];
            let tlas = ctx.create_tlas(&TlasDesc { instances: &instances, ..Default::default() })?;
            let records = tracer.trace(&tlas, &rays, How::default())?;
            let found = records.iter().map(|it| (it.kind != MISSED).then_some((it.primitive, it.t)));
            let expected = [Some((0, 1.0)), Some((1, 1.0)), Some((2, 1.0)), None];
            assert!(found.eq(expected), "{count} vertices, {flags:?}: {records:?}");
        }
    }
    Ok(())
}

#[test]
fn compaction_has_nothing_to_do_and_says_so() -> Result<()> {
    let Some(ctx) = bare_device(RayQueryRequest::Software) else { return Ok(()) };
    let flags = BuildFlags::FAST_TRACE | BuildFlags::ALLOW_COMPACTION;
    let gpu = crowd().upload_with(&ctx, flags, BuildFlags::default(), 0)?;
    let models: Vec<_> = gpu.models.iter().map(|model| **model).collect();
    ctx.compact(&models)?;
    ctx.wait_idle()?;
    for model in models {
        let info = ctx.accel_struct_info(model)?;
        let bytes = info.structure_bytes;
        assert_eq!(info.compaction, lvk::Compaction::Done { before_bytes: bytes, after_bytes: bytes });
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.build_blas(&[model], BuildMode::Rebuild)?;
        ctx.submit(cmd)?;
    }
    ctx.wait_idle()
}

/// A TLAS may show parts of trees that a rebuild has replaced: what it sees then stays within them, and is
/// the same where nothing moved.
#[test]
fn rebuilds_below_parts_of_instances_are_seen() -> Result<()> {
    let Some(ctx) = bare_device(RayQueryRequest::Software) else { return Ok(()) };
    let scene = RayScene::scattered(GeometryFlags::OPAQUE);
    let gpu = scene.upload(&ctx)?;
    let reference = scene.reference();
    let (low, high) = reference.bounds();
    let rays = random_rays(31, 900, low.as_vec3(), high.as_vec3());
    let tracer = RayTracer::new(&ctx, Method::Query)?;
    let agrees = |what: &str| -> Result<()> {
        let records = tracer.trace(&gpu.tlas, &rays, How::default())?;
        HitComparison::of_triangles(&rays, &records, |ray| reference.closest(ray, 0xff)).assert(what);
        Ok(())
    };
    agrees("parts")?;
    let models: Vec<_> = gpu.models.iter().map(|model| **model).collect();
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.build_blas(&models, BuildMode::Rebuild)?;
    ctx.submit(cmd)?;
    agrees("rebuilt below")?;
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.update_tlas(*gpu.tlas, &instances(&scene.placed, &gpu.models), BuildMode::Rebuild)?;
    ctx.submit(cmd)?;
    agrees("rebuilt above")
}

/// Scratch memory of builds: the buffer has no more than the largest build needs if the budget is 0.
#[test]
fn scratch_memory_is_what_the_sizes_say() -> Result<()> {
    const ALIGNMENTS: u64 = 1024;
    let profile = DeviceProfile::no_ray_tracing();
    let fresh = || {
        device_with(|desc| {
            desc.profile = Some(&profile);
            desc.ray_query = RayQueryRequest::Software;
            desc.scratch_budget_bytes = 0;
        })
    };
    for flags in BUILD_FLAGS {
        let may_refit = flags.contains(BuildFlags::ALLOW_UPDATE);
        for mode in [BuildMode::Refit, BuildMode::Rebuild].into_iter().skip(usize::from(!may_refit)) {
            let Some(ctx) = fresh() else { return Ok(()) };
            let parts = [Part::new(Mesh::terrain(90), Layout::Indexed32)];
            let (_buffers, geometries) = upload_geometries(&ctx, &parts)?;
            let desc = BlasDesc { geometries: &geometries, flags, ..Default::default() };
            let most = ctx.blas_sizes(&desc)?;
            let blas = ctx.create_blas(&desc)?;
            let said = ctx.accel_struct_sizes(*blas)?;
            let case = format!("{flags:?}, {mode:?}: {said:?} of {most:?}");
            assert!(said.structure_bytes <= most.structure_bytes, "{case}");
            assert_eq!(said.build_scratch_bytes, most.build_scratch_bytes, "{case}");
            assert_eq!(said.update_scratch_bytes > 0, may_refit, "{case}");
            assert!(said.update_scratch_bytes <= most.update_scratch_bytes, "{case}");
            ctx.wait(ctx.flush()?)?;
            let first = ctx.accel_memory().scratch_bytes;
            let mut cmd = ctx.acquire_command_buffer()?;
            cmd.build_blas(&[*blas], mode)?;
            ctx.wait(ctx.submit(cmd)?)?;
            let taken = ctx.accel_memory().scratch_bytes;
            // The tree of the CPU has fewer nodes than that of its rebuild, whose refit is in the figure too.
            let (least, most) = match mode {
                BuildMode::Refit if first == 0 => (said.update_scratch_bytes / 3, said.update_scratch_bytes),
                _ => (said.build_scratch_bytes, said.build_scratch_bytes),
            };
            assert!((least..most + ALIGNMENTS).contains(&taken), "{taken} bytes, {case}");
        }
    }
    Ok(())
}

/// Bytes of the acceleration structure of a mesh, by `accel_struct_sizes`.
fn bytes_of(ctx: &Context, mesh: &Mesh, layout: Layout, flags: BuildFlags) -> Result<u64> {
    let (_buffers, geometries) = upload_geometries(ctx, &[Part::new(mesh.clone(), layout)])?;
    let desc = BlasDesc { geometries: &geometries, flags, ..Default::default() };
    let (most, blas) = (ctx.blas_sizes(&desc)?, ctx.create_blas(&desc)?);
    let bytes = ctx.accel_struct_sizes(*blas)?.structure_bytes;
    assert!(bytes <= most.structure_bytes, "{flags:?}, {layout:?}: {bytes} of {most:?}");
    Ok(bytes)
}

/// A BLAS that may be refitted shares vertices as its indices do, and stores no unused vertex.
#[test]
fn low_memory_is_low_with_updates_too() -> Result<()> {
    let Some(ctx) = bare_device(RayQueryRequest::Software) else { return Ok(()) };
    let small = BuildFlags::LOW_MEMORY | BuildFlags::ALLOW_UPDATE;
    let mesh = Mesh::terrain(90);
    let count = mesh.triangles.len() as u64;
    for layout in [Layout::Indexed16, Layout::Indexed32, Layout::Interleaved] {
        let bytes = bytes_of(&ctx, &mesh, layout, small)?;
        assert!(bytes < 28 * count, "{layout:?}: {bytes} bytes of {count} triangles");
        let mut more = mesh.clone();
        more.positions.resize(mesh.positions.len() + 5_000, [0.5; 3]);
        assert_eq!(bytes_of(&ctx, &more, layout, small)?, bytes, "{layout:?}, unused vertices");
    }
    let copies = bytes_of(&ctx, &mesh, Layout::Unshared, BuildFlags::ALLOW_UPDATE)?;
    assert_eq!(bytes_of(&ctx, &mesh, Layout::Unshared, small)?, copies, "nothing is shared");
    let shared = bytes_of(&ctx, &mesh, Layout::Indexed32, small)?;
    let fixed = bytes_of(&ctx, &mesh, Layout::Unshared, BuildFlags::LOW_MEMORY)?;
    assert_eq!(fixed, shared, "positions are, where none may move");
    Ok(())
}

/// Builds on the GPU take no more memory than those on the CPU, though the number of nodes is not known before.
#[test]
fn accel_structs_of_the_gpu_are_small() -> Result<()> {
    const FIRST: u64 = 1024;
    let Some(ctx) = bare_device(RayQueryRequest::Software) else { return Ok(()) };
    let mesh = Mesh::terrain(90);
    let count = mesh.triangles.len() as u64;
    for (more, most) in [(BuildFlags::ALLOW_UPDATE, 56), (BuildFlags::LOW_MEMORY, 28)] {
        let bytes = bytes_of(&ctx, &mesh, Layout::Indexed32, BuildFlags::FAST_BUILD | more)?;
        assert!(bytes <= most * count + FIRST, "{more:?}: {bytes} bytes of {count} triangles");
    }
    Ok(())
}

/// Flags that allow refits, so that re-braiding never opens it.
#[test]
fn structures_of_the_cpu_are_rebuilt_in_the_same_memory() -> Result<()> {
    let Some(ctx) = bare_device(RayQueryRequest::Software) else { return Ok(()) };
    let mesh = Mesh::terrain(90);
    let count = mesh.triangles.len() as u64;
    let (_buffers, geometries) = upload_geometries(&ctx, &[Part::new(mesh, Layout::Indexed32)])?;
    for (flags, most) in [(BuildFlags::ALLOW_UPDATE, 58), (BuildFlags::FAST_TRACE, 116)] {
        let blas = ctx.create_blas(&BlasDesc { geometries: &geometries, flags, ..Default::default() })?;
        let before = ctx.accel_struct_info(*blas)?.structure_bytes;
        for mode in [BuildMode::Rebuild, BuildMode::Auto { max_refits: 4 }, BuildMode::Rebuild] {
            let mut cmd = ctx.acquire_command_buffer()?;
            cmd.build_blas(&[*blas], mode)?;
            ctx.wait(ctx.submit(cmd)?)?;
        }
        let after = ctx.accel_struct_info(*blas)?.structure_bytes;
        assert_eq!(after == before, flags == BuildFlags::ALLOW_UPDATE, "{before} and {after} bytes");
        assert!(after <= most * count, "{flags:?}: {after} bytes of {count} triangles");
    }
    Ok(())
}
