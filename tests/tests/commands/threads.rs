//! Threads: all of them share one context, and command buffers move between them.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::sync::Barrier;

use lvk::test_hooks::{before_next_command_buffer, waiting_objects};
use lvk::{
    BlasDesc, BlasGeometry, BufferDesc, BufferHandle, BufferUsage, BuildFlags, BuildMode, ColorAttachment,
    CommandBuffer, ComputePipelineDesc, Context, Dependencies, Error, Format, HitGroup, Holder,
    QueryPoolDesc, RayTracingPipelineDesc, RenderPassDesc, RenderPipelineDesc, SamplerDesc,
    ShaderModuleHandle, ShaderStage, SpecializationConstant, SpecializationValue, SubmitHandle, TextureDesc,
    TextureRegion, TextureUsage, TextureViewDesc, TlasDesc, TlasInstance, Triangles, ValidationSink,
};
use lvk_tests::compute::{Evaluator, module, read_vec4, read_words, vec4_buffer, words_buffer};
use lvk_tests::noise::noise;
use lvk_tests::shader_groups::{Counts, GroupScene, answering, ray_gen};
use lvk_tests::{device, device_with};

const fn is_send<T: Send>() {}
const fn is_shared<T: Send + Sync + Clone>() {}

const _: () = {
    is_shared::<Context>();
    is_shared::<BufferHandle>();
    is_shared::<SubmitHandle>();
    is_shared::<ValidationSink>();
    is_send::<CommandBuffer>();
    is_send::<Holder<BufferHandle>>();
};

/// Creates, uploads, records, submits and reads back, all of it again and again.
fn work(ctx: &Context, evaluator: &Evaluator, thread: u32) {
    for round in 0..15 {
        let value = (100 * thread + round) as f32;
        let texels = [value; 64];
        let data = Some(bytemuck::cast_slice(&texels));
        let desc = TextureDesc { format: Format::R32Float, extent: [8, 8], data, ..Default::default() };
        let texture = ctx.create_texture(&desc).unwrap();
        let words = words_buffer(ctx, &[thread; 500]);
        let result = vec4_buffer(ctx, 8);
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.fill_buffer(*words, 0, 1000, round).unwrap();
        evaluator.record(ctx, &mut cmd, [texture.index(), 0, 0], (*result, 8), &Dependencies::default());
        let done = ctx.submit(cmd).unwrap();
        if round % 3 == 0 {
            ctx.wait(done).unwrap();
        }
        drop(texture);
        let found = read_vec4(ctx, *result, 8);
        assert!(found.iter().all(|found| found[0] == value), "thread {thread}, round {round}: {found:?}");
        let expected = [[round; 250], [thread; 250]].concat();
        assert_eq!(read_words(ctx, *words, 500), expected, "thread {thread}, round {round}");
    }
}

#[test]
fn four_threads_work_side_by_side() {
    let Some(ctx) = device() else { return };
    let evaluator = Evaluator::new(&ctx, "textureBindlessFetch2D(a, ivec2(i, i), 0)");
    std::thread::scope(|scope| {
        for thread in 0..4 {
            let (ctx, evaluator) = (&*ctx, &evaluator);
            scope.spawn(move || work(ctx, evaluator, thread));
        }
    });
}

#[test]
fn command_buffers_are_recorded_on_threads_and_submitted_on_one() {
    let Some(ctx) = device() else { return };
    let buffers: Vec<_> = (0..4).map(|_| words_buffer(&ctx, &[0; 256])).collect();
    let record = |thread: u32| {
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        for (part, buffer) in (0..).zip(&buffers) {
            cmd.fill_buffer(**buffer, 256 * u64::from(thread), 256, 10 * thread + part).unwrap();
        }
        cmd
    };
    let recorded: Vec<CommandBuffer> = std::thread::scope(|scope| {
        let record = &record;
        let threads: Vec<_> = (0..4).map(|thread| scope.spawn(move || record(thread))).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    for cmd in recorded.into_iter().rev() {
        ctx.submit(cmd).unwrap();
    }
    for (part, buffer) in (0..).zip(&buffers) {
        let expected: Vec<u32> = (0..256).map(|word| 10 * (word / 64) + part).collect();
        assert_eq!(read_words(&ctx, **buffer, 256), expected);
    }
}

#[test]
fn shaders_compile_side_by_side() {
    let Some(ctx) = device() else { return };
    let found: Vec<f32> = std::thread::scope(|scope| {
        let ctx = &*ctx;
        let compile = |thread: u32| {
            let evaluator = Evaluator::new(ctx, &format!("vec4({thread} * 2 + 1)"));
            evaluator.run(ctx, [0; 3], 1, &Dependencies::default())[0][0]
        };
        let threads: Vec<_> = (0..4).map(|thread| scope.spawn(move || compile(thread))).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert_eq!(found, [1.0, 3.0, 5.0, 7.0]);
}

/// State shared by the threads of [`eight_threads_use_every_kind_of_object`].
struct Shared<'a> {
    ctx: &'a Context,
    evaluator: Evaluator,
    modules: [Holder<ShaderModuleHandle>; 3],
    /// Written by every thread, each its own part.
    words: Holder<BufferHandle>,
    rays: Option<Rays<'a>>,
}

/// A thread's words in the shared buffer.
const SHARE: u64 = 64;

impl Shared<'_> {
    fn new(ctx: &Context) -> Shared<'_> {
        let module = |stage, text| module(ctx, stage, text);
        let vertex = "void main() { gl_Position = vec4(gl_VertexIndex == 1 ? 3 : -1, gl_VertexIndex == 2 ? 3 : -1, 0, 1); }";
        let fragment = "layout(push_constant) uniform Push { float value; };
             layout(location = 0) out vec4 color;
             void main() { color = vec4(value); }";
        let compute = "layout(local_size_x = 64) in;
             layout(buffer_reference, scalar) buffer Words { uint at[]; };
             layout(push_constant, scalar) uniform Push { Words words; uint value; uint unused; };
             void main() { words.at[gl_LocalInvocationID.x] = value; }";
        Shared {
            ctx,
            evaluator: Evaluator::new(ctx, "textureBindless2D(a, b, vec2(0.5))"),
            modules: [
                module(ShaderStage::Vertex, vertex),
                module(ShaderStage::Fragment, fragment),
                module(ShaderStage::Compute, compute),
            ],
            words: words_buffer(ctx, &[0; SHARE as usize * 8]),
            rays: Rays::new(ctx),
        }
    }

    /// A pipeline, a target and a view of it; a pass, a sampler, a query; what was drawn is sampled through the view.
    fn draw(&self, value: f32) {
        let ctx = self.ctx;
        let format = Format::Rgba32Float;
        let usage = TextureUsage::TARGET | TextureUsage::SAMPLED;
        let target =
            ctx.create_texture(&TextureDesc { format, extent: [4, 4], usage, ..Default::default() }).unwrap();
        let view = TextureViewDesc { texture: Some(*target), ..Default::default() };
        let view = ctx.create_texture_view(&view).unwrap();
        let sampler = ctx.create_sampler(&SamplerDesc::default()).unwrap();
        let times = QueryPoolDesc { count: 1, ..Default::default() };
        let times = ctx.create_query_pool(&times).unwrap();
        let color = [format.into()];
        let desc = RenderPipelineDesc {
            vertex: Some(*self.modules[0]),
            fragment: Some(*self.modules[1]),
            color: &color,
            ..Default::default()
        };
        let pipeline = ctx.create_render_pipeline(&desc).unwrap();
        let result = vec4_buffer(ctx, 1);
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        let color = [ColorAttachment::clear(*target, [0.0; 4])];
        let mut pass = cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).unwrap();
        pass.bind_render_pipeline(*pipeline).unwrap();
        pass.push_constants(&value).unwrap();
        pass.draw(0..3, 0..1).unwrap();
        drop(pass);
        cmd.write_timestamp(*times, 0).unwrap();
        let images = [*view];
        let sampled = Dependencies { sampled_images: &images, ..Default::default() };
        self.evaluator.record(ctx, &mut cmd, [view.index(), sampler.index(), 0], (*result, 1), &sampled);
        ctx.submit(cmd).unwrap();
        drop((target, view, sampler, pipeline));
        assert_eq!(read_vec4(ctx, *result, 1), [[value; 4]]);
        let mut ticks = [None];
        ctx.read_queries(*times, 0, &mut ticks).unwrap();
        assert!(ticks[0].is_some());
    }

    /// A compute pipeline writes the thread's part of the shared buffer, which is read later.
    fn compute(&self, thread: u64, value: u32) {
        let ctx = self.ctx;
        let desc = ComputePipelineDesc { module: Some(*self.modules[2]), ..Default::default() };
        let pipeline = ctx.create_compute_pipeline(&desc).unwrap();
        let address = ctx.buffer_address(*self.words).unwrap() + thread * SHARE * 4;
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.bind_compute_pipeline(*pipeline).unwrap();
        cmd.push_constants(&[address, u64::from(value)]).unwrap();
        let buffers = [*self.words];
        cmd.dispatch([1, 1, 1], &Dependencies { buffers: &buffers, ..Default::default() }).unwrap();
        ctx.submit(cmd).unwrap();
        let own = thread * SHARE * 4..(thread + 1) * SHARE * 4;
        let read = ctx.read_buffer_later(*self.words, own).unwrap();
        drop(pipeline);
        let found: Vec<u32> = bytemuck::pod_collect_to_vec(&read.wait().unwrap());
        assert_eq!(found, [value; SHARE as usize]);
    }

    /// Structures of both levels, refitted and gone while they are in flight; one is never submitted.
    fn trace(&self) {
        let ctx = self.ctx;
        if !ctx.capabilities().ray_query {
            return;
        }
        let corners = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let desc = BufferDesc {
            data: Some(bytemuck::cast_slice(&corners)),
            usage: BufferUsage::ACCEL_INPUT,
            ..Default::default()
        };
        let vertices = ctx.create_buffer(&desc).unwrap();
        let geometries = [BlasGeometry::Triangles(Triangles::packed(*vertices, 3))];
        let blas = ctx.create_blas(&BlasDesc { geometries: &geometries, ..Default::default() }).unwrap();
        let instances = [TlasInstance::new(*blas)];
        let flags = BuildFlags::FAST_TRACE | BuildFlags::ALLOW_UPDATE;
        let desc = TlasDesc { instances: &instances, flags, ..Default::default() };
        let tlas = ctx.create_tlas(&desc).unwrap();
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.update_tlas(*tlas, &instances, BuildMode::Refit).unwrap();
        ctx.submit(cmd).unwrap();
        let mut given_up = ctx.acquire_command_buffer().unwrap();
        given_up.update_tlas(*tlas, &instances, BuildMode::Rebuild).unwrap();
        drop((tlas, blas, vertices, given_up));
    }
}

/// Shaders of ray tracing pipelines, and what their rays meet.
struct Rays<'a> {
    ctx: &'a Context,
    scene: GroupScene,
    ray_gen: Holder<ShaderModuleHandle>,
    /// Each answers its place, above what its pipeline is specialised with.
    hits: Vec<Holder<ShaderModuleHandle>>,
    misses: Vec<Holder<ShaderModuleHandle>>,
    callables: Vec<Holder<ShaderModuleHandle>>,
}

impl Rays<'_> {
    /// `None`, loudly, where the device has no such pipelines.
    fn new(ctx: &Context) -> Option<Rays<'_>> {
        if !ctx.capabilities().ray_tracing_pipeline {
            eprintln!("NOT TESTED, {} has no ray tracing pipelines", ctx.capabilities().device_name);
            return None;
        }
        let constant = "layout(constant_id = 3) const uint kOwn = 0;";
        let answer =
            |stage, place: u32| answering(ctx, stage, constant, &format!("kOwn + {place}u")).unwrap();
        let all = |stage, places: std::ops::Range<u32>| places.map(|place| answer(stage, place)).collect();
        Some(Rays {
            ctx,
            scene: GroupScene::new(ctx).unwrap(),
            ray_gen: ray_gen(ctx, "", "0u").unwrap(),
            hits: all(ShaderStage::ClosestHit, 0..4),
            misses: all(ShaderStage::Miss, 4..6),
            callables: all(ShaderStage::Callable, 6..7),
        })
    }

    /// A pipeline that answers numbers of its own, with its hit groups turned by as many places; gone while it is in flight.
    fn trace(&self, value: u32) {
        let handles = |modules: &[Holder<ShaderModuleHandle>]| -> Vec<_> {
            modules.iter().map(|module| **module).collect()
        };
        let mut order: Vec<usize> = (0..self.hits.len()).collect();
        order.rotate_left(value as usize % self.hits.len());
        let hit = |at: &usize| HitGroup { closest_hit: Some(*self.hits[*at]), ..Default::default() };
        let own = SpecializationValue::U32(100 * value);
        let pipeline = self.ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
            ray_gen: &[*self.ray_gen],
            miss: &handles(&self.misses),
            hit_groups: &order.iter().map(hit).collect::<Vec<_>>(),
            callable: &handles(&self.callables),
            specialization: &[SpecializationConstant { id: 3, value: own }],
            ..Default::default()
        });
        let pipeline = pipeline.unwrap();
        let counts = Counts { hits: 4, misses: 2, callables: 1 };
        let results = words_buffer(self.ctx, &[u32::MAX; 7]);
        let mut cmd = self.ctx.acquire_command_buffer().unwrap();
        self.scene.bind(&mut cmd, *pipeline, counts, *results).unwrap();
        let buffers = [*results];
        let writes = Dependencies { buffers: &buffers, ..Default::default() };
        cmd.trace_rays([counts.all(), 1, 1], &writes).unwrap();
        self.ctx.submit(cmd).unwrap();
        drop(pipeline);
        let places = order.iter().map(|at| *at as u32).chain(4..7);
        let expected: Vec<u32> = places.map(|place| 100 * value + place).collect();
        assert_eq!(read_words(self.ctx, *results, 7), expected, "pipeline {value}");
    }
}

/// Eight threads begin at once, and each makes some.
#[test]
fn ray_tracing_pipelines_are_made_side_by_side() {
    let Some(ctx) = device() else { return };
    let Some(rays) = Rays::new(&ctx) else { return };
    let start = Barrier::new(8);
    std::thread::scope(|scope| {
        for thread in 0..8_u32 {
            let (rays, start) = (&rays, &start);
            scope.spawn(move || {
                start.wait();
                (0..4).for_each(|round| rays.trace(4 * thread + round));
            });
        }
    });
    ctx.wait_idle().unwrap();
    assert_eq!(waiting_objects(&ctx).unwrap(), 0);
}

/// Creates, uploads, records, submits, reads back and destroys, of every kind, while seven others do. The order of the
/// library's locks is checked on the way.
#[test]
fn eight_threads_use_every_kind_of_object() {
    let Some(ctx) = device_with(|desc| desc.staging_bytes = 1 << 20) else { return };
    let shared = Shared::new(&ctx);
    std::thread::scope(|scope| {
        for thread in 0..8_u32 {
            let shared = &shared;
            scope.spawn(move || {
                for round in 0..5 {
                    let value = 10 * thread + round;
                    match (thread + round) % 5 {
                        0 => shared.draw(value as f32),
                        1 => shared.compute(thread.into(), value),
                        2 => shared.trace(),
                        3 => shared.rays.iter().for_each(|rays| rays.trace(value)),
                        _ => {
                            let noise = noise(value, 100_000);
                            let desc = BufferDesc { data: Some(&noise), ..Default::default() };
                            let buffer = shared.ctx.create_buffer(&desc).unwrap();
                            let read = shared.ctx.read_buffer_later(*buffer, 0..100_000).unwrap();
                            drop(buffer);
                            assert!(read.wait().unwrap() == noise);
                        }
                    }
                    shared.ctx.next_frame().unwrap();
                }
            });
        }
    });
    ctx.wait_idle().unwrap();
    assert_eq!(waiting_objects(&ctx).unwrap(), 0);
}

/// Destroys an object as another thread may, right before the library takes a command buffer to use it with.
fn destroy_before_use<T: 'static>(object: T) {
    before_next_command_buffer(move || drop(object));
}

/// Fails unless the object was found to be gone. The GPU would still read it otherwise, when its memory goes.
#[track_caller]
fn expect_stale<T: std::fmt::Debug>(found: lvk::Result<T>) {
    assert!(matches!(found, Err(Error::StaleHandle { .. })), "{found:?}");
}

#[test]
fn a_read_fails_if_another_thread_destroys_the_object_first() {
    let Some(ctx) = device() else { return };
    let buffer = || {
        let buffer = words_buffer(&ctx, &[7; 64]);
        ctx.wait_idle().unwrap();
        let handle = *buffer;
        destroy_before_use(buffer);
        handle
    };
    expect_stale(ctx.read_buffer_later(buffer(), 0..256));
    expect_stale(ctx.download_buffer(buffer(), 0, &mut [0; 256]));
    let texture = || {
        let data: Option<&[u8]> = Some(&[9; 64]);
        let desc = TextureDesc { format: Format::Rgba8Unorm, extent: [4, 4], data, ..Default::default() };
        let texture = ctx.create_texture(&desc).unwrap();
        ctx.wait_idle().unwrap();
        let handle = *texture;
        destroy_before_use(texture);
        handle
    };
    expect_stale(ctx.read_texture_later(texture(), &TextureRegion::default()));
    expect_stale(ctx.download_texture(texture(), &TextureRegion::default()));
    ctx.wait_idle().unwrap();
    assert_eq!(waiting_objects(&ctx).unwrap(), 0);
}
