//! Ray tracing pipelines: shader order, records, stacks, libraries, indirect traces, and errors.

use lvk::{
    BufferDesc, BufferUsage, ColorAttachment, Context, Dependencies, Error, HitGroup, Holder,
    RayTracingLibraryDesc, RayTracingPipelineDesc, RayTracingPipelineRequest, RenderPassDesc, Result,
    ShaderModuleHandle, ShaderRecord, ShaderStage, SpecializationConstant, SpecializationValue, TextureDesc,
    TextureUsage, record_bytes,
};
use lvk_tests::compute::{compute_pipeline, read_words, words_buffer};
use lvk_tests::random::Random;
use lvk_tests::ray_tracer::shader;
use lvk_tests::shader_groups::{Counts, GroupScene, answering, ray_gen};
use lvk_tests::{TestDevice, device, device_with};

/// A context with ray tracing pipelines, or a word about why there is none.
fn pipeline_device() -> Option<TestDevice> {
    let ctx = device()?;
    if ctx.capabilities().ray_tracing_pipeline {
        return Some(ctx);
    }
    eprintln!("NOT TESTED, {} has no ray tracing pipelines", ctx.capabilities().device_name);
    None
}

/// As [`pipeline_device`], with pipeline libraries.
fn library_device() -> Option<TestDevice> {
    let ctx = pipeline_device()?;
    if ctx.capabilities().pipeline_libraries {
        return Some(ctx);
    }
    eprintln!("NOT TESTED, {} has no pipeline libraries", ctx.capabilities().device_name);
    None
}

type Module = Holder<ShaderModuleHandle>;

/// Shaders of a stage that answer these numbers.
fn tagged(ctx: &Context, stage: ShaderStage, tags: impl IntoIterator<Item = u32>) -> Result<Vec<Module>> {
    tags.into_iter().map(|tag| answering(ctx, stage, "", &format!("{tag}u"))).collect()
}

fn handles(modules: &[Module]) -> Vec<ShaderModuleHandle> {
    modules.iter().map(|module| **module).collect()
}

fn hit_groups(modules: &[Module]) -> Vec<HitGroup<'static>> {
    modules.iter().map(|module| HitGroup { closest_hit: Some(**module), ..Default::default() }).collect()
}

fn shuffle<T>(random: &mut Random, items: &mut [T]) {
    for end in (1..items.len()).rev() {
        items.swap(end, (random.bits() % (end as u64 + 1)) as usize);
    }
}

#[test]
fn shaders_stand_in_the_order_of_their_lists() -> Result<()> {
    let Some(ctx) = pipeline_device() else { return Ok(()) };
    let scene = GroupScene::new(&ctx)?;
    let counts = Counts { hits: 4, misses: 3, callables: 3 };
    let mut random = Random::new(7);
    let (mut hit_tags, mut miss_tags, mut call_tags) =
        (vec![11, 12, 13, 14], vec![21, 22, 23], vec![31, 32, 33]);
    let mut gen_tags = vec![1000, 2000];
    for _ in 0..3 {
        shuffle(&mut random, &mut hit_tags);
        shuffle(&mut random, &mut miss_tags);
        shuffle(&mut random, &mut call_tags);
        shuffle(&mut random, &mut gen_tags);
        let hits = tagged(&ctx, ShaderStage::ClosestHit, hit_tags.clone())?;
        let misses = tagged(&ctx, ShaderStage::Miss, miss_tags.clone())?;
        let callables = tagged(&ctx, ShaderStage::Callable, call_tags.clone())?;
        let ray_gens: Result<Vec<_>> =
            gen_tags.iter().map(|tag| ray_gen(&ctx, "", &format!("{tag}u"))).collect();
        let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
            ray_gen: &handles(&ray_gens?),
            miss: &handles(&misses),
            hit_groups: &hit_groups(&hits),
            callable: &handles(&callables),
            ..Default::default()
        })?;
        for (index, tag) in (0..).zip(&gen_tags) {
            let all = hit_tags.iter().chain(&miss_tags).chain(&call_tags);
            let expected: Vec<u32> = all.map(|shader| tag + shader).collect();
            assert_eq!(scene.run(*pipeline, index, counts)?, expected);
        }
    }
    Ok(())
}

/// Shader record of the tests.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::NoUninit)]
struct Tag {
    number: u32,
    weight: f32,
    more: [u32; 3],
}

impl Tag {
    const BLOCK: &str =
        "layout(shaderRecordEXT, scalar) buffer Record { uint number; float weight; uint more[3]; };";
    const SUM: &str = "number + uint(weight * 4.0) + more[2]";

    fn new(number: u32) -> Self {
        Self { number, weight: number as f32 * 0.25, more: [0, 0, number * 100] }
    }

    /// Returns the value of [`SUM`](Self::SUM).
    fn sum(number: u32) -> u32 {
        number * 102
    }
}

#[test]
fn every_kind_of_shader_reads_its_own_record() -> Result<()> {
    let Some(ctx) = pipeline_device() else { return Ok(()) };
    let scene = GroupScene::new(&ctx)?;
    let shader = |stage| answering(&ctx, stage, Tag::BLOCK, Tag::SUM);
    let hit = shader(ShaderStage::ClosestHit)?;
    let miss = shader(ShaderStage::Miss)?;
    let plain_miss = answering(&ctx, ShaderStage::Miss, "", "5u")?;
    let callable = shader(ShaderStage::Callable)?;
    let ray_gen = ray_gen(&ctx, Tag::BLOCK, Tag::SUM)?;
    let tags: Vec<Tag> = (0..20).map(Tag::new).collect();
    let record = |number: usize| record_bytes(&tags[number]);
    // Longer than the shader reads: the longest decides the stride.
    let long = [record(2).bytes(), &[0xee; 77][..]].concat();
    let group = |record| HitGroup { closest_hit: Some(*hit), record, ..Default::default() };
    let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*ray_gen; 2],
        miss: &[*miss, *miss, *plain_miss],
        hit_groups: &[group(record(1)), group(ShaderRecord::from_bytes(&long)), group(record(3))],
        callable: &[*callable; 2],
        ray_gen_records: &[record(11), record(12)],
        miss_records: &[record(4), record(5)],
        callable_records: &[record(6), record(7)],
        ..Default::default()
    })?;
    for (index, number) in [(0, 11), (1, 12)] {
        let answers = scene.run(*pipeline, index, Counts { hits: 3, misses: 3, callables: 2 })?;
        let of_hits_and_misses = [1, 2, 3, 4, 5].map(Tag::sum);
        let of_callables = [6, 7].map(Tag::sum);
        let expected = [&of_hits_and_misses[..], &[5], &of_callables].concat();
        assert_eq!(answers, expected.iter().map(|answer| answer + Tag::sum(number)).collect::<Vec<_>>());
    }
    Ok(())
}

/// Vulkan sets the stack size of a pipeline outside of passes only.
#[test]
fn a_forgotten_pass_ends_before_a_pipeline_is_bound() -> Result<()> {
    let Some(ctx) = pipeline_device() else { return Ok(()) };
    let ray_gen = ray_gen(&ctx, "", "0u")?;
    let desc = RayTracingPipelineDesc { ray_gen: &[*ray_gen], ..Default::default() };
    let pipeline = ctx.create_ray_tracing_pipeline(&desc)?;
    let target = ctx.create_texture(&TextureDesc { usage: TextureUsage::TARGET, ..Default::default() })?;
    let color = [ColorAttachment::clear(*target, [0.0; 4])];
    let mut cmd = ctx.acquire_command_buffer()?;
    std::mem::forget(cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() })?);
    cmd.bind_ray_tracing_pipeline(*pipeline)?;
    ctx.submit(cmd)?;
    ctx.wait_idle()
}

#[test]
fn records_too_many_or_too_long_are_refused() -> Result<()> {
    let Some(ctx) = pipeline_device() else { return Ok(()) };
    let ray_gen = ray_gen(&ctx, "", "0u")?;
    let miss = answering(&ctx, ShaderStage::Miss, "", "1u")?;
    let callable = answering(&ctx, ShaderStage::Callable, "", "1u")?;
    let limits = &ctx.capabilities().limits;
    let long = vec![0; (limits.sbt_max_stride - limits.sbt_handle_bytes + 1) as usize];
    let fits = ShaderRecord::from_bytes(&long[1..]);
    let none = [ShaderRecord::default(); 3];
    let good = RayTracingPipelineDesc {
        ray_gen: &[*ray_gen],
        miss: &[*miss],
        callable: &[*callable],
        debug_name: "with records",
        ..Default::default()
    };
    let create = |desc| ctx.create_ray_tracing_pipeline(&desc).map(drop);
    for (words, desc) in [
        ("2 records for 1 ray generation", RayTracingPipelineDesc { ray_gen_records: &none[..2], ..good }),
        ("3 records for 1 miss", RayTracingPipelineDesc { miss_records: &none[..3], ..good }),
        ("2 records for 1 callable", RayTracingPipelineDesc { callable_records: &none[..2], ..good }),
    ] {
        usage(words, create(desc));
    }
    let records = [ShaderRecord::from_bytes(&long)];
    for (region, desc) in [
        ("ray generation shader record", RayTracingPipelineDesc { ray_gen_records: &records, ..good }),
        ("miss shader record", RayTracingPipelineDesc { miss_records: &records, ..good }),
        ("callable shader record", RayTracingPipelineDesc { callable_records: &records, ..good }),
    ] {
        match create(desc) {
            Err(Error::LimitExceeded { what, object, .. }) => {
                assert_eq!((what, &*object), (region, "with records"));
            }
            other => unreachable!("{region}: {other:?}"),
        }
    }
    create(RayTracingPipelineDesc { miss_records: &[fits], ray_gen_records: &[fits], ..good })
}

/// Fails unless the outcome is the caller's mistake with these words.
#[track_caller]
fn usage(words: &str, outcome: Result<()>) {
    let error = outcome.err();
    let named =
        |error: &Error| matches!(error, Error::InvalidUsage { .. }) && error.to_string().contains(words);
    assert!(error.as_ref().is_some_and(named), "{words}: {error:?}");
}

#[test]
fn callables_call_callables_as_deep_as_announced() -> Result<()> {
    const CALLING: &str = "
        layout(location = 1) callableDataEXT uint inner;
        uint call(uint next, uint factor) {
            uint kept[4];
            for (uint i = 0; i < 4; i++) { kept[i] = factor * (i + 1); }
            inner = 0;
            executeCallableEXT(next, 1);
            return kept[inner % 4] * 1000 + inner;
        }";
    let Some(ctx) = pipeline_device() else { return Ok(()) };
    let scene = GroupScene::new(&ctx)?;
    let ray_gen = ray_gen(&ctx, "", "0u")?;
    let first = answering(&ctx, ShaderStage::Callable, CALLING, "call(1, 7)")?;
    let second = answering(&ctx, ShaderStage::Callable, "", "42u")?;
    let create = |max_callable_depth| {
        ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
            ray_gen: &[*ray_gen],
            callable: &[*first, *second],
            max_callable_depth,
            ..Default::default()
        })
    };
    let pipeline = create(2)?;
    let answers = scene.run(*pipeline, 0, Counts { hits: 0, misses: 0, callables: 2 })?;
    assert_eq!(answers, [21_042, 42]);
    let bytes = |depth| ctx.ray_tracing_stack_bytes(*create(depth)?);
    let [none, one, two, three] = [bytes(0)?, bytes(1)?, bytes(2)?, bytes(3)?];
    assert!(none <= one && one - none == two - one && two - one == three - two);
    Ok(())
}

#[test]
fn the_stack_grows_with_the_recursion() -> Result<()> {
    let Some(ctx) = pipeline_device() else { return Ok(()) };
    let most = ctx.capabilities().limits.max_ray_recursion.min(4);
    let ray_gen = ray_gen(&ctx, "", "0u")?;
    let miss = answering(&ctx, ShaderStage::Miss, "", "1u")?;
    let hit = answering(&ctx, ShaderStage::ClosestHit, "", "1u")?;
    let create = |max_recursion| {
        ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
            ray_gen: &[*ray_gen],
            miss: &[*miss],
            hit_groups: &hit_groups(std::slice::from_ref(&hit)),
            max_recursion,
            ..Default::default()
        })
    };
    let bytes: Result<Vec<u32>> =
        (1..=most).map(|depth| ctx.ray_tracing_stack_bytes(*create(depth)?)).collect();
    let bytes = bytes?;
    assert!(bytes.is_sorted(), "{bytes:?}");
    let steps: Vec<u32> = bytes.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(steps.windows(2).all(|pair| pair[0] == pair[1]), "{bytes:?}");
    Ok(())
}

/// The size is written by the dispatch right before, with no barrier in between but the library's own.
#[test]
fn an_indirect_trace_reads_what_a_dispatch_wrote() -> Result<()> {
    const WRITE: &str = "
        layout(local_size_x = 1) in;
        layout(buffer_reference, scalar) buffer Words { uint at[]; };
        layout(push_constant, scalar) uniform Push { Words arguments; uint width; };
        void main() {
            arguments.at[1] = width;
            arguments.at[2] = 1;
            arguments.at[3] = 1;
        }";
    let Some(ctx) = pipeline_device() else { return Ok(()) };
    if !ctx.capabilities().trace_rays_indirect {
        eprintln!("NOT TESTED, {} traces nothing indirectly", ctx.capabilities().device_name);
        return Ok(());
    }
    let scene = GroupScene::new(&ctx)?;
    let ray_gens = [ray_gen(&ctx, "", "0u")?, ray_gen(&ctx, "", "500u")?];
    let misses = tagged(&ctx, ShaderStage::Miss, 1..6)?;
    let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &handles(&ray_gens),
        miss: &handles(&misses),
        ..Default::default()
    })?;
    let write = compute_pipeline(&ctx, WRITE);
    let usage = BufferUsage::STORAGE | BufferUsage::INDIRECT;
    let arguments =
        ctx.create_buffer(&BufferDesc { size_bytes: 16, usage, debug_name: "size", ..Default::default() })?;
    let counts = Counts { hits: 0, misses: 5, callables: 0 };
    for (ray_gen, width) in [(0, 5), (1, 3), (0, 0), (1, 5)] {
        let results = words_buffer(&ctx, &[99; 5]);
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.bind_compute_pipeline(*write)?;
        #[repr(C)]
        #[derive(Clone, Copy, bytemuck::NoUninit)]
        struct Push(u64, u32, u32);
        cmd.push_constants(&Push(ctx.buffer_address(*arguments)?, width, 0))?;
        cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*arguments], ..Default::default() })?;
        scene.bind(&mut cmd, *pipeline, counts, *results)?;
        let writes = Dependencies { buffers: &[*results], ..Default::default() };
        cmd.trace_rays_indirect(ray_gen, *arguments, 4, &writes)?;
        ctx.submit(cmd)?;
        let answer = |index: u32| if index < width { index + 1 + 500 * ray_gen } else { 99 };
        assert_eq!(read_words(&ctx, *results, 5), (0..5).map(answer).collect::<Vec<_>>());
    }
    Ok(())
}

#[test]
fn indirect_traces_that_cannot_run_are_refused() -> Result<()> {
    let Some(ctx) = pipeline_device() else { return Ok(()) };
    if !ctx.capabilities().trace_rays_indirect {
        return Ok(());
    }
    let scene = GroupScene::new(&ctx)?;
    let ray_gen = ray_gen(&ctx, "", "0u")?;
    let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*ray_gen],
        ..Default::default()
    })?;
    let buffer = |usage| ctx.create_buffer(&BufferDesc { size_bytes: 16, usage, ..Default::default() });
    let (arguments, storage) = (buffer(BufferUsage::INDIRECT)?, buffer(BufferUsage::STORAGE)?);
    let counts = Counts { hits: 0, misses: 0, callables: 0 };
    let none = Dependencies::default();
    let mut cmd = ctx.acquire_command_buffer()?;
    usage("bind a ray tracing pipeline first", cmd.trace_rays_indirect(0, *arguments, 0, &none));
    cmd.bind_ray_tracing_pipeline(*pipeline)?;
    usage("20 bytes of push constants", cmd.trace_rays_indirect(0, *arguments, 0, &none));
    scene.bind(&mut cmd, *pipeline, counts, *storage)?;
    usage("INDIRECT", cmd.trace_rays_indirect(0, *storage, 0, &none));
    usage("no multiple of 4", cmd.trace_rays_indirect(0, *arguments, 2, &none));
    for offset in [8, 16, u64::MAX - 3] {
        usage("outside of the buffer", cmd.trace_rays_indirect(0, *arguments, offset, &none));
    }
    usage("ray generation shader 1 does not exist", cmd.trace_rays_indirect(1, *arguments, 0, &none));
    let gone = *buffer(BufferUsage::INDIRECT)?;
    let stale = cmd.trace_rays_indirect(0, gone, 0, &none);
    assert!(matches!(stale, Err(Error::StaleHandle { kind: "buffer", .. })), "{stale:?}");
    ctx.submit(cmd)?;
    Ok(())
}

#[test]
fn without_pipelines_everything_about_them_is_unsupported() -> Result<()> {
    let Some(ctx) = device_with(|desc| desc.ray_tracing_pipeline = RayTracingPipelineRequest::Off) else {
        return Ok(());
    };
    let caps = ctx.capabilities();
    assert!(!caps.trace_rays_indirect && !caps.pipeline_libraries);
    let arguments = ctx.create_buffer(&BufferDesc {
        size_bytes: 12,
        usage: BufferUsage::INDIRECT,
        ..Default::default()
    })?;
    let mut cmd = ctx.acquire_command_buffer()?;
    let none = Dependencies::default();
    let outcomes = [
        cmd.trace_rays_indirect(0, *arguments, 0, &none),
        ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc::default()).map(drop),
        ctx.create_ray_tracing_library(&RayTracingLibraryDesc::default()).map(drop),
    ];
    for outcome in outcomes {
        assert!(matches!(outcome, Err(Error::Unsupported { .. })), "{outcome:?}");
    }
    Ok(())
}

/// Each list has the pipeline's own shaders first, then those of each library, each with its own record; and the
/// libraries may go before the pipeline runs.
#[test]
fn groups_of_libraries_follow_the_pipelines_own_shaders() -> Result<()> {
    let Some(ctx) = library_device() else { return Ok(()) };
    let scene = GroupScene::new(&ctx)?;
    let shader = |stage| answering(&ctx, stage, Tag::BLOCK, Tag::SUM);
    let (hit, miss) = (shader(ShaderStage::ClosestHit)?, shader(ShaderStage::Miss)?);
    let callable = shader(ShaderStage::Callable)?;
    let tags: Vec<Tag> = (0..20).map(Tag::new).collect();
    let record = |number: usize| record_bytes(&tags[number]);
    let group = |number| HitGroup { closest_hit: Some(*hit), record: record(number), ..Default::default() };
    let ray_gens = [ray_gen(&ctx, "", "0u")?, ray_gen(&ctx, "", "5000u")?, ray_gen(&ctx, "", "9000u")?];
    let first = ctx.create_ray_tracing_library(&RayTracingLibraryDesc {
        miss: &[*miss],
        hit_groups: &[group(1), group(2)],
        callable: &[*callable],
        miss_records: &[record(3)],
        callable_records: &[record(4)],
        debug_name: "first",
        ..Default::default()
    })?;
    let second = ctx.create_ray_tracing_library(&RayTracingLibraryDesc {
        ray_gen: &[*ray_gens[1]],
        miss: &[*miss],
        callable: &[*callable],
        miss_records: &[record(5)],
        callable_records: &[record(6)],
        debug_name: "second",
        ..Default::default()
    })?;
    let own = RayTracingPipelineDesc {
        ray_gen: &[*ray_gens[0], *ray_gens[2]],
        miss: &[*miss],
        hit_groups: &[group(7)],
        callable: &[*callable],
        miss_records: &[record(8)],
        callable_records: &[record(9)],
        ..Default::default()
    };
    let forth =
        ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc { libraries: &[*first, *second], ..own })?;
    let back =
        ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc { libraries: &[*second, *first], ..own })?;
    // Nothing of its own but what libraries give.
    let linked = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        libraries: &[*first, *second],
        ..Default::default()
    })?;
    drop((first, second));
    let expect = |pipeline: &Holder<_>, ray_gen, add, counts: Counts, numbers: &[u32]| -> Result<()> {
        let expected: Vec<u32> = numbers.iter().map(|number| Tag::sum(*number) + add).collect();
        assert_eq!(scene.run(**pipeline, ray_gen, counts)?, expected);
        Ok(())
    };
    let counts = Counts { hits: 3, misses: 3, callables: 3 };
    for (ray_gen, add) in [(0, 0), (1, 9000), (2, 5000)] {
        expect(&forth, ray_gen, add, counts, &[7, 1, 2, 8, 3, 5, 9, 4, 6])?;
        expect(&back, ray_gen, add, counts, &[7, 1, 2, 8, 5, 3, 9, 6, 4])?;
    }
    expect(&linked, 0, 5000, Counts { hits: 2, misses: 2, callables: 2 }, &[1, 2, 3, 5, 4, 6])
}

/// The same groups, compiled at once or linked, need the same stack; no group is asked for a shader it lacks.
#[test]
fn the_stack_counts_the_groups_of_libraries() -> Result<()> {
    const FILTER: &str = "void main() { if ((gl_PrimitiveID & 1) != 0) { ignoreIntersectionEXT; } }";
    const BOX: &str = "
        hitAttributeEXT vec2 where;
        void main() { where = vec2(0.5); reportIntersectionEXT(gl_RayTminEXT + 1.0, 3u); }";
    let Some(ctx) = library_device() else { return Ok(()) };
    let ray_gen = ray_gen(&ctx, "", "0u")?;
    let (first, second) =
        (tagged(&ctx, ShaderStage::ClosestHit, [1])?, tagged(&ctx, ShaderStage::Callable, [2, 3])?);
    let miss = answering(&ctx, ShaderStage::Miss, "", "1u")?;
    let any_hit = shader(&ctx, ShaderStage::AnyHit, FILTER)?;
    let intersection = shader(&ctx, ShaderStage::Intersection, BOX)?;
    let any_hit = Some(*any_hit);
    let hit_groups = [
        HitGroup { closest_hit: Some(*first[0]), ..Default::default() },
        HitGroup { any_hit, ..Default::default() },
        HitGroup { any_hit, intersection: Some(*intersection), ..Default::default() },
        HitGroup::default(),
    ];
    let whole = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*ray_gen],
        miss: &[*miss],
        hit_groups: &hit_groups,
        callable: &handles(&second),
        ..Default::default()
    })?;
    let hits = ctx.create_ray_tracing_library(&RayTracingLibraryDesc {
        hit_groups: &hit_groups,
        ..Default::default()
    })?;
    let rest = ctx.create_ray_tracing_library(&RayTracingLibraryDesc {
        ray_gen: &[*ray_gen],
        callable: &handles(&second),
        ..Default::default()
    })?;
    let linked = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        miss: &[*miss],
        libraries: &[*hits, *rest],
        ..Default::default()
    })?;
    let (whole, linked) = (ctx.ray_tracing_stack_bytes(*whole)?, ctx.ray_tracing_stack_bytes(*linked)?);
    assert_eq!(whole, linked);
    Ok(())
}

#[test]
fn a_library_keeps_the_constants_it_was_compiled_with() -> Result<()> {
    const BLOCK: &str = "layout(constant_id = 3) const uint kept = 1;";
    let Some(ctx) = library_device() else { return Ok(()) };
    let scene = GroupScene::new(&ctx)?;
    let ray_gen = ray_gen(&ctx, "", "0u")?;
    let miss = answering(&ctx, ShaderStage::Miss, BLOCK, "kept")?;
    let constant = |value| [SpecializationConstant { id: 3, value: SpecializationValue::U32(value) }];
    let library = ctx.create_ray_tracing_library(&RayTracingLibraryDesc {
        miss: &[*miss],
        specialization: &constant(70),
        ..Default::default()
    })?;
    let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*ray_gen],
        miss: &[*miss],
        libraries: &[*library],
        specialization: &constant(60),
        ..Default::default()
    })?;
    assert_eq!(scene.run(*pipeline, 0, Counts { hits: 0, misses: 2, callables: 0 })?, [60, 70]);
    Ok(())
}

#[test]
fn libraries_that_do_not_fit_are_refused() -> Result<()> {
    let Some(ctx) = library_device() else { return Ok(()) };
    let ray_gen = ray_gen(&ctx, "", "0u")?;
    let miss = answering(&ctx, ShaderStage::Miss, "", "1u")?;
    let good = RayTracingLibraryDesc { miss: &[*miss], debug_name: "shared", ..Default::default() };
    let library = ctx.create_ray_tracing_library(&good)?;
    let (libraries, own) = ([*library], [*ray_gen]);
    let linked = RayTracingPipelineDesc { ray_gen: &own, libraries: &libraries, ..Default::default() };
    let pipeline = |desc| ctx.create_ray_tracing_pipeline(&desc).map(drop);
    let other = |desc| ctx.create_ray_tracing_library(&desc).map(drop);
    pipeline(linked)?;
    let words = "max_payload_bytes is 16, but 64 in the library 'shared'";
    usage(words, pipeline(RayTracingPipelineDesc { max_payload_bytes: 16, ..linked }));
    let words = "max_hit_attribute_bytes is 12, but 8 in the library 'shared'";
    usage(words, pipeline(RayTracingPipelineDesc { max_hit_attribute_bytes: 12, ..linked }));
    let limits = &ctx.capabilities().limits;
    if limits.max_ray_recursion > 1 {
        let words = "max_recursion is 2, but 1 in the library 'shared'";
        usage(words, pipeline(RayTracingPipelineDesc { max_recursion: 2, ..linked }));
    }
    usage("at least one ray generation", pipeline(RayTracingPipelineDesc { ray_gen: &[], ..linked }));
    usage("at least one shader or hit group", other(RayTracingLibraryDesc { miss: &[], ..good }));
    usage(
        "has 4 bytes, more than max_payload_bytes",
        other(RayTracingLibraryDesc { max_payload_bytes: 3, ..good }),
    );
    usage("Miss module is needed", other(RayTracingLibraryDesc { miss: &own, ..good }));
    usage("0 traces no ray", other(RayTracingLibraryDesc { max_recursion: 0, ..good }));
    let too_much = limits.max_hit_attribute_bytes + 1;
    let attributes = other(RayTracingLibraryDesc { max_hit_attribute_bytes: too_much, ..good });
    assert!(
        matches!(attributes, Err(Error::LimitExceeded { what: "hit attributes in bytes", .. })),
        "{attributes:?}"
    );
    drop(library);
    let stale = pipeline(linked);
    assert!(matches!(stale, Err(Error::StaleHandle { kind: "ray tracing library", .. })), "{stale:?}");
    Ok(())
}

/// A library that is still alive is destroyed with the context, with a report and without another message.
#[test]
fn a_library_may_outlive_everything_but_the_context() -> Result<()> {
    let Some(ctx) = library_device() else { return Ok(()) };
    let miss = answering(&ctx, ShaderStage::Miss, "", "1u")?;
    let desc = RayTracingLibraryDesc { miss: &[*miss], ..Default::default() };
    let _ = ctx.create_ray_tracing_library(&desc)?.release();
    Ok(())
}

/// Many threads compile at once, each on many cores.
#[test]
fn pipelines_compile_side_by_side() -> Result<()> {
    let Some(ctx) = pipeline_device() else { return Ok(()) };
    let scene = GroupScene::new(&ctx)?;
    let ray_gen = ray_gen(&ctx, "", "0u")?;
    let context: &Context = &ctx;
    let compile = |first: u32| {
        let misses = tagged(context, ShaderStage::Miss, first..first + 2)?;
        context.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
            ray_gen: &[*ray_gen],
            miss: &handles(&misses),
            ..Default::default()
        })
    };
    let pipelines: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4).map(|index| scope.spawn(move || compile(index * 10))).collect();
        threads.into_iter().map(|thread| thread.join()).collect()
    });
    for (index, pipeline) in (0..).zip(pipelines) {
        let Ok(pipeline) = pipeline else { unreachable!("a thread that compiles does not panic") };
        let answers = scene.run(*pipeline?, 0, Counts { hits: 0, misses: 2, callables: 0 })?;
        assert_eq!(answers, [index * 10, index * 10 + 1]);
    }
    Ok(())
}
