//! Commands that a queue does not support: the same errors on every device; and profiling on queues.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    BufferHandle, BufferUsage, BuildMode, ClearValue, ColorAttachment, CommandBuffer, Context, Dependencies,
    DeviceInstances, Error, Filter, Format, Holder, ImportedBuffer, QueryKind, QueryPoolDesc, Queue,
    RayTracingPipelineDesc, RenderPassDesc, ShaderStage, SubmitHandle, TextureDesc, TextureRange,
    TextureRegion, TextureUsage, TlasDesc,
};
use lvk_tests::compute::{module, read_words, words_buffer};
use lvk_tests::device_with;
use lvk_tests::queues::{WORDS, for_each_queue_request, step, step_pipeline, submit_on};
use lvk_tests::raster::usage_error;

/// Asserts that a command was refused for its queue.
fn wrong_queue<T>(result: lvk::Result<T>, wanted: Queue) {
    match result.map(drop) {
        Err(error @ Error::WrongQueue { queue, .. }) => {
            assert_eq!(queue, wanted);
            assert!(error.to_string().contains("acquire a command buffer on Queue::"), "{error}");
        }
        other => unreachable!("expected a refusal by the {wanted:?} queue, not {other:?}"),
    }
}

/// Refused alike on every device, and the command buffer stays as it was.
#[test]
fn queues_refuse_what_they_cannot_do() {
    for_each_queue_request(|ctx| {
        let pipeline = step_pipeline(ctx);
        let words = words_buffer(ctx, &[1; WORDS]);
        let usage = TextureUsage::SAMPLED | TextureUsage::STORAGE | TextureUsage::TARGET;
        let desc = TextureDesc { format: Format::R32Float, extent: [4, 4], usage, ..Default::default() };
        let [image, other] = [(); 2].map(|()| ctx.create_texture(&desc).unwrap());
        let usage = TextureUsage::TARGET | TextureUsage::SAMPLED;
        let depth = TextureDesc { format: Format::D32Float, extent: [4, 4], usage, ..Default::default() };
        let depth = ctx.create_texture(&depth).unwrap();
        let (whole, all) = (TextureRegion::default(), TextureRange::default());
        let kind = QueryKind::Occlusion { precise: false };
        let occlusion = ctx.create_query_pool(&QueryPoolDesc { kind, ..Default::default() }).unwrap();
        for queue in [Queue::Compute, Queue::Transfer] {
            let mut cmd = ctx.acquire_command_buffer_on(queue).unwrap();
            let color = [ColorAttachment::clear(*image, [0.0; 4])];
            let pass = RenderPassDesc { color: &color, ..Default::default() };
            wrong_queue(cmd.begin_rendering(&pass), queue);
            wrong_queue(cmd.blit_texture(*image, &whole, *other, &whole, Filter::Nearest), queue);
            wrong_queue(cmd.generate_mipmaps(*image), queue);
            wrong_queue(cmd.resolve_texture(*image, &whole, *other, &whole), queue);
            wrong_queue(cmd.clear_texture(*depth, ClearValue::Depth(1.0), &all), queue);
            wrong_queue(cmd.copy_texture_to_buffer(*depth, &whole, *words, 0), queue);
            wrong_queue(cmd.copy_buffer_to_texture(*words, 0, *depth, &whole), queue);
            wrong_queue(cmd.update_texture(*depth, &whole, &[0; 4 * 4 * 4]), queue);
            wrong_queue(cmd.begin_query(*occlusion, 0), queue);
            if queue == Queue::Transfer {
                wrong_queue(cmd.bind_compute_pipeline(*pipeline), queue);
                wrong_queue(cmd.clear_texture(*image, ClearValue::Color([1.0; 4]), &all), queue);
                wrong_queue(cmd.reset_queries(*occlusion, 0..1), queue);
                wrong_queue(cmd.build_blas(&[], BuildMode::Rebuild), queue);
                wrong_queue(ctx.create_blas_batch_on(queue, &[]), queue);
                refuse_rays(ctx, &mut cmd, *words);
            }
            wrong_queue(cmd.copy_texture(*depth, &whole, *depth, &whole), queue);
            cmd.fill_buffer(*words, 0, 256, 8).unwrap();
            ctx.submit(cmd).unwrap();
            assert_eq!(read_words(ctx, *words, WORDS), [8; WORDS]);
        }
        check_foreign(ctx, &words);
    });
}

/// Asserts that the transfer queue refuses traces and updates of TLAS, where the device has them.
fn refuse_rays(ctx: &Context, cmd: &mut CommandBuffer, words: BufferHandle) {
    let caps = ctx.capabilities();
    if caps.ray_tracing_pipeline {
        let ray_gen = module(ctx, ShaderStage::RayGen, "void main() {}");
        let desc = RayTracingPipelineDesc { ray_gen: &[*ray_gen], ..Default::default() };
        let pipeline = ctx.create_ray_tracing_pipeline(&desc).unwrap();
        wrong_queue(cmd.bind_ray_tracing_pipeline(*pipeline), Queue::Transfer);
    }
    if caps.ray_tracing_pipeline || caps.ray_query {
        let tlas = ctx.create_tlas(&TlasDesc { capacity: 1, ..Default::default() }).unwrap();
        let nothing = DeviceInstances { buffer: words, offset: 0, count: 0, blas: &[] };
        wrong_queue(cmd.update_tlas(*tlas, &[], BuildMode::Rebuild), Queue::Transfer);
        wrong_queue(cmd.update_tlas_from_buffer(*tlas, &nothing, BuildMode::Rebuild), Queue::Transfer);
    }
}

/// Images and buffers of others belong to the graphics queue unless they were made for all.
fn check_foreign(ctx: &Context, words: &Holder<BufferHandle>) {
    let import = |concurrent| {
        let import = ImportedBuffer {
            buffer: ctx.raw_buffer(**words).unwrap(),
            size_bytes: 256,
            usage: BufferUsage::STORAGE,
            concurrent,
            debug_name: "another application's",
        };
        // SAFETY: the buffer is this context's own, outlives the handle, and is not used otherwise meanwhile.
        unsafe { ctx.import_buffer(&import) }.unwrap()
    };
    for queue in [Queue::Compute, Queue::Transfer] {
        for concurrent in [false, true] {
            let foreign = import(concurrent);
            let mut cmd = ctx.acquire_command_buffer_on(queue).unwrap();
            cmd.fill_buffer(*foreign, 0, 256, 3).unwrap();
            let answer = ctx.submit(cmd);
            if concurrent {
                answer.unwrap();
            } else {
                usage_error(answer, "another application's: images of windows, and what was imported");
            }
            ctx.wait_idle().unwrap();
        }
    }
}

#[test]
fn submissions_of_another_context_cannot_be_waited_for() {
    let (Some(ctx), Some(other)) = (device_with(|_| {}), device_with(|_| {})) else { return };
    let foreign = submit_on(&other, Queue::Graphics, |_| {});
    let pipeline = step_pipeline(&ctx);
    let [a, b] = [(); 2].map(|()| words_buffer(&ctx, &[2; WORDS]));
    submit_on(&ctx, Queue::Compute, |cmd| {
        step(&ctx, cmd, *pipeline, [*a, *b], 1);
        let wait_for = [SubmitHandle::default(), foreign];
        let deps = Dependencies { wait_for: &wait_for, ..Default::default() };
        usage_error(cmd.dispatch([1, 1, 1], &deps), "belongs to another context");
        let deps = Dependencies { wait_for: &wait_for[..1], ..Default::default() };
        cmd.dispatch([0, 0, 0], &deps).unwrap();
    });
    assert_eq!(read_words(&ctx, *b, WORDS), [7; WORDS]);
}

/// Pools go from queue to queue, too: reset on one, written on another, read by the host.
#[test]
fn timestamps_are_taken_on_every_queue_that_has_them() {
    for_each_queue_request(|ctx| {
        let pool = ctx.create_query_pool(&QueryPoolDesc { count: 6, ..Default::default() }).unwrap();
        let words = words_buffer(ctx, &[1; WORDS]);
        let queues = Queue::ALL.map(|queue| (queue, ctx.capabilities().queue(queue).timestamp_bits > 0));
        for round in 0..2 {
            if round == 1 {
                submit_on(ctx, Queue::Compute, |cmd| cmd.reset_queries(*pool, 0..6).unwrap());
            }
            for ((queue, has), first) in queues.into_iter().zip([0, 2, 4]) {
                let mut cmd = ctx.acquire_command_buffer_on(queue).unwrap();
                let written = cmd.write_timestamp(*pool, first);
                if !has {
                    eprintln!("NOT TESTED: no timestamps on the {queue:?} queue");
                    assert!(matches!(written, Err(Error::Unsupported { .. })));
                    continue;
                }
                written.unwrap();
                cmd.fill_buffer(*words, 0, 256, first).unwrap();
                cmd.write_timestamp(*pool, first + 1).unwrap();
                ctx.submit(cmd).unwrap();
            }
            ctx.wait_idle().unwrap();
            let times = ctx.timestamps_ms(*pool, 0, 6).unwrap();
            for ((_, has), pair) in queues.into_iter().zip(times.chunks(2)) {
                assert_eq!(pair.iter().flatten().count(), if has { 2 } else { 0 });
                assert!(pair.is_sorted());
            }
        }
    });
}

#[test]
fn profiles_have_the_scopes_of_all_queues() {
    for_each_queue_request(|ctx| {
        ctx.set_profiling(true).unwrap();
        let pipeline = step_pipeline(ctx);
        let [a, b] = [(); 2].map(|()| words_buffer(ctx, &[2; WORDS]));
        for _ in 0..4 {
            ctx.next_frame().unwrap();
            for (queue, name) in [(Queue::Compute, "computed"), (Queue::Graphics, "drawn")] {
                submit_on(ctx, queue, |cmd| {
                    cmd.push_label(name);
                    step(ctx, cmd, *pipeline, [*a, *b], 1);
                });
            }
        }
        ctx.wait_idle().unwrap();
        let profile = ctx.last_profile().unwrap().unwrap();
        let names: Vec<_> = profile.scopes.iter().map(|scope| scope.name.as_str()).collect();
        assert!(names.contains(&"computed") && names.contains(&"drawn"), "{names:?}");
        for scope in &profile.scopes {
            assert!(scope.start_ms >= 0.0 && scope.start_ms + scope.ms <= profile.ms * 1.001, "{profile}");
        }
    });
}
