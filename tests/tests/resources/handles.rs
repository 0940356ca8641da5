//! Handles: stale and foreign handles return errors, and no object is destroyed while it is in use.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fmt::Debug;

use lvk::ash::vk;
use lvk::{
    BufferDesc, ClearValue, ColorAttachment, ComputePipelineDesc, Context, Dependencies, Destroy, Error,
    Format, Holder, LiveObject, QueryPoolDesc, RenderPassDesc, RenderPipelineDesc, SamplerDesc, ShaderStage,
    TextureDesc, TextureRange, TextureRegion, ValidationSink,
};
use lvk_tests::compute::{
    Evaluator, compute_pipeline, module, read_vec4, read_words, vec4_buffer, words_buffer,
};
use lvk_tests::raster::target;
use lvk_tests::warnings::{capture_warnings, take_warnings};
use lvk_tests::{TestDevice, device, device_with};

/// The reason why a handle has no object.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Refusal {
    Stale,
    Foreign,
}

impl Refusal {
    #[track_caller]
    fn expect<T: Debug>(self, result: lvk::Result<T>, expected: &str) {
        let (refusal, kind) = match result {
            Err(Error::StaleHandle { kind, name: Some(_) }) => (Self::Stale, kind),
            Err(Error::ForeignHandle { kind }) => (Self::Foreign, kind),
            other => unreachable!("expected a {self:?} {expected}, not {other:?}"),
        };
        assert_eq!((refusal, kind), (self, expected));
    }
}

/// Every call that takes a handle, with one of each kind that is not `ctx`'s or not alive.
fn expect_all_refused(ctx: &Context, made: &Objects, refusal: Refusal) {
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let Objects { buffer, texture, module, pipeline, pool, .. } = made;
    let good = words_buffer(ctx, &[0; 4]);
    refusal.expect(ctx.buffer_address(*buffer), "buffer");
    refusal.expect(ctx.upload_buffer(*buffer, 0, &[0]), "buffer");
    refusal.expect(ctx.download_buffer(*buffer, 0, &mut [0]), "buffer");
    refusal.expect(cmd.copy_buffer(*buffer, 0, *good, 0, 4), "buffer");
    refusal.expect(cmd.copy_buffer(*good, 0, *buffer, 0, 4), "buffer");
    refusal.expect(cmd.fill_buffer(*buffer, 0, 4, 0), "buffer");
    let whole = TextureRegion::default();
    refusal.expect(ctx.upload_texture(*texture, &whole, &[0; 4]), "texture");
    refusal.expect(ctx.download_texture(*texture, &whole), "texture");
    refusal.expect(cmd.copy_texture_to_buffer(*texture, &whole, *good, 0), "texture");
    refusal.expect(
        cmd.clear_texture(*texture, ClearValue::Color([0.0; 4]), &TextureRange::default()),
        "texture",
    );
    refusal.expect(cmd.generate_mipmaps(*texture), "texture");
    let color = [lvk::ColorAttachment::clear(*texture, [0.0; 4])];
    refusal.expect(
        cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).map(drop),
        "texture",
    );
    refusal.expect(cmd.bind_compute_pipeline(*pipeline), "compute pipeline");
    let desc = ComputePipelineDesc { module: Some(*module), ..Default::default() };
    refusal.expect(ctx.create_compute_pipeline(&desc), "shader module");
    let desc = RenderPipelineDesc { vertex: Some(*module), ..Default::default() };
    refusal.expect(ctx.create_render_pipeline(&desc), "shader module");
    refusal.expect(cmd.write_timestamp(*pool, 0), "query pool");
    refusal.expect(cmd.reset_queries(*pool, 0..1), "query pool");
    refusal.expect(ctx.timestamps_ms(*pool, 0, 1), "query pool");
    let nothing = compute_pipeline(ctx, "layout(local_size_x = 1) in; void main() {}");
    cmd.bind_compute_pipeline(*nothing).unwrap();
    for dependencies in [
        Dependencies { buffers: &[*good, *buffer], ..Default::default() },
        Dependencies { read_buffers: &[*buffer], ..Default::default() },
    ] {
        refusal.expect(cmd.dispatch([1, 1, 1], &dependencies), "buffer");
    }
    for dependencies in [
        Dependencies { sampled_images: &[*texture], ..Default::default() },
        Dependencies { storage_images: &[*texture], ..Default::default() },
    ] {
        refusal.expect(cmd.dispatch([1, 1, 1], &dependencies), "texture");
    }
    refusal.expect(cmd.dispatch_indirect(*buffer, 0, &Dependencies::default()), "buffer");
    ctx.submit(cmd).unwrap();
}

/// One handle of each kind.
struct Objects {
    buffer: lvk::BufferHandle,
    texture: lvk::TextureHandle,
    sampler: lvk::SamplerHandle,
    module: lvk::ShaderModuleHandle,
    pipeline: lvk::ComputePipelineHandle,
    pool: lvk::QueryPoolHandle,
}

fn objects(ctx: &Context) -> Objects {
    let text = "layout(local_size_x = 1) in; void main() {}";
    Objects {
        buffer: words_buffer(ctx, &[1, 2, 3]).release(),
        texture: ctx
            .create_texture(&TextureDesc { data: Some(&[1; 4]), ..Default::default() })
            .unwrap()
            .release(),
        sampler: ctx.create_sampler(&SamplerDesc::default()).unwrap().release(),
        module: module(ctx, ShaderStage::Compute, text).release(),
        pipeline: compute_pipeline(ctx, text).release(),
        pool: ctx.create_query_pool(&QueryPoolDesc::default()).unwrap().release(),
    }
}

fn destroy(ctx: &Context, objects: &Objects) {
    ctx.destroy(objects.buffer);
    ctx.destroy(objects.texture);
    ctx.destroy(objects.sampler);
    ctx.destroy(objects.module);
    ctx.destroy(objects.pipeline);
    ctx.destroy(objects.pool);
}

#[test]
fn destroyed_objects_leave_stale_handles() {
    let Some(ctx) = device() else { return };
    let made = objects(&ctx);
    assert_eq!(read_words(&ctx, made.buffer, 3), [1, 2, 3]);
    destroy(&ctx, &made);
    expect_all_refused(&ctx, &made, Refusal::Stale);
    destroy(&ctx, &made);
    let news = objects(&ctx);
    destroy(&ctx, &made);
    assert_eq!(read_words(&ctx, news.buffer, 3), [1, 2, 3], "the old handle must not destroy its successor");
    expect_all_refused(&ctx, &made, Refusal::Stale);
    destroy(&ctx, &news);
}

#[test]
fn handles_that_destroy_nothing_are_warned_of() {
    let (Some(ctx), Some(other)) = (device(), device()) else { return };
    capture_warnings();
    let theirs = objects(&other);
    destroy(&ctx, &theirs);
    for kind in ["buffer", "texture", "sampler", "shader module", "compute pipeline", "query pool"] {
        let warning = format!("nothing is destroyed: foreign {kind} handle");
        let told = take_warnings(&warning);
        assert!(!told.is_empty() && told[0].contains("use the handle with the context"), "{kind}: {told:?}");
    }
    assert_eq!(read_words(&other, theirs.buffer, 3), [1, 2, 3]);
    destroy(&other, &theirs);
    let desc = BufferDesc { size_bytes: 16, debug_name: "destroyed twice", ..Default::default() };
    let buffer = ctx.create_buffer(&desc).unwrap();
    let stale = *buffer;
    ctx.destroy(stale);
    drop(buffer);
    assert_eq!(take_warnings("destroyed twice"), [""; 0], "the holder of a destroyed object says nothing");
    ctx.destroy(stale);
    let told = take_warnings("destroyed twice");
    assert!(matches!(&told[..], [told] if told.contains("destroy it once")), "{told:?}");
}

#[test]
fn labels_that_are_closed_and_not_open_are_warned_of() {
    let Some(ctx) = device() else { return };
    capture_warnings();
    let color = target(&ctx, Format::Rgba8Unorm, [4, 4]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.set_debug_name("pops too often");
    cmd.pop_label();
    let told = take_warnings("pops too often");
    assert!(matches!(&told[..], [told] if told.contains("push a label before")), "{told:?}");
    cmd.push_label("around the pass");
    let targets = [ColorAttachment::clear(*color, [0.0; 4])];
    let desc = RenderPassDesc { color: &targets, debug_name: "pass", ..Default::default() };
    let mut pass = cmd.begin_rendering(&desc).unwrap();
    pass.pop_label();
    let told = take_warnings("pops too often");
    assert!(matches!(&told[..], [told] if told.contains("in the pass before")), "{told:?}");
    drop(pass);
    cmd.pop_label();
    assert_eq!(take_warnings("pops too often"), [""; 0]);
    ctx.wait(ctx.submit(cmd).unwrap()).unwrap();
}

#[test]
fn handles_of_another_context_are_foreign() {
    let (Some(ctx), Some(other)) = (device(), device()) else { return };
    let made = objects(&ctx);
    let theirs = objects(&other);
    expect_all_refused(&ctx, &theirs, Refusal::Foreign);
    destroy(&ctx, &theirs);
    assert_eq!(read_words(&other, theirs.buffer, 3), [1, 2, 3]);
    assert_eq!(read_words(&ctx, made.buffer, 3), [1, 2, 3]);
    destroy(&ctx, &made);
    destroy(&other, &theirs);
}

#[test]
fn errors_of_handles_name_the_object_or_the_other_context() {
    let (Some(ctx), Some(other)) = (device(), device()) else { return };
    let desc = BufferDesc { size_bytes: 16, debug_name: "positions", ..Default::default() };
    let (ours, theirs) = (ctx.create_buffer(&desc).unwrap(), other.create_buffer(&desc).unwrap());
    let foreign = ctx.buffer_address(*theirs).unwrap_err();
    assert_eq!(
        foreign.to_string(),
        "foreign buffer handle: the object belongs to another context; use the handle with the context that made it"
    );
    let handle = *ours;
    drop(ours);
    // Another object takes the place of the destroyed one.
    let named = BufferDesc { debug_name: "colours", ..desc };
    let next = ctx.create_buffer(&named).unwrap();
    let stale = ctx.buffer_address(handle).unwrap_err();
    let text = "stale buffer handle: 'positions' was destroyed; keep its holder while the handle is in use";
    assert_eq!(stale.to_string(), text);
    assert_eq!(format!("{stale:?}"), text);
    assert!(ctx.buffer_address(*next).is_ok());
}

#[test]
fn command_buffers_of_another_context_are_refused() {
    let (Some(ctx), Some(other)) = (device(), device()) else { return };
    let buffer = words_buffer(&other, &[1]);
    let mut cmd = other.acquire_command_buffer().unwrap();
    cmd.fill_buffer(*buffer, 0, 4, 9).unwrap();
    assert!(matches!(ctx.submit(cmd), Err(Error::InvalidUsage { .. })));
    assert_eq!(read_words(&other, *buffer, 1), [1]);
}

#[test]
fn a_released_object_outlives_its_holder() {
    let Some(ctx) = device() else { return };
    let holder = words_buffer(&ctx, &[5]);
    let copy = *holder;
    assert_eq!(holder.handle(), copy);
    let kept = holder.release();
    assert_eq!(kept, copy);
    assert_eq!(read_words(&ctx, kept, 1), [5]);
    ctx.destroy(kept);
    Refusal::Stale.expect(ctx.buffer_address(kept), "buffer");
}

fn drop_and_expect_stale<H: Destroy>(ctx: &Context, holder: Holder<H>, check: impl FnOnce(&Context, H)) {
    let handle = *holder;
    drop(holder);
    check(ctx, handle);
}

#[test]
fn dropping_a_holder_destroys() {
    let Some(ctx) = device() else { return };
    drop_and_expect_stale(&ctx, words_buffer(&ctx, &[1]), |ctx, handle| {
        Refusal::Stale.expect(ctx.buffer_address(handle), "buffer")
    });
    let texture = ctx.create_texture(&TextureDesc::default()).unwrap();
    drop_and_expect_stale(&ctx, texture, |ctx, handle| {
        Refusal::Stale.expect(ctx.raw_image(handle), "texture")
    });
    let sampler = ctx.create_sampler(&SamplerDesc::default()).unwrap();
    drop_and_expect_stale(&ctx, sampler, |ctx, handle| {
        Refusal::Stale.expect(ctx.raw_sampler(handle), "sampler")
    });
}

#[test]
fn objects_destroyed_in_flight_finish_their_work() {
    let Some(ctx) = device() else { return };
    let results: Vec<_> = (0..30)
        .map(|value| {
            let texels = [value as f32; 4];
            let data = Some(bytemuck::cast_slice(&texels));
            let desc =
                TextureDesc { format: lvk::Format::R32Float, extent: [2, 2], data, ..Default::default() };
            let texture = ctx.create_texture(&desc).unwrap();
            let sampler = ctx.create_sampler(&SamplerDesc::default()).unwrap();
            let sample = Evaluator::new(&ctx, "textureBindless2D(a, b, vec2(0.5)) + float(c)");
            let result = vec4_buffer(&ctx, 1);
            let mut cmd = ctx.acquire_command_buffer().unwrap();
            let words = [texture.index(), sampler.index(), 100];
            sample.record(&ctx, &mut cmd, words, (*result, 1), &Dependencies::default());
            if value % 2 == 0 {
                ctx.submit(cmd).unwrap();
            } else {
                drop((sampler, texture, sample));
                ctx.submit(cmd).unwrap();
            }
            (value, result)
        })
        .collect();
    for (value, result) in &results {
        assert_eq!(read_vec4(&ctx, **result, 1)[0][0], *value as f32 + 100.0);
    }
}

#[test]
fn buffers_destroyed_before_their_submission_are_still_copied() {
    let Some(ctx) = device() else { return };
    let target = words_buffer(&ctx, &[0; 4]);
    let source = words_buffer(&ctx, &[1, 2, 3, 4]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.copy_buffer(*source, 0, *target, 0, 16).unwrap();
    drop(source);
    for value in 0..4 {
        drop(words_buffer(&ctx, &[value; 4]));
        ctx.wait_idle().unwrap();
    }
    ctx.submit(cmd).unwrap();
    assert_eq!(read_words(&ctx, *target, 4), [1, 2, 3, 4]);
}

#[test]
fn dropped_command_buffers_do_nothing() {
    let Some(ctx) = device() else { return };
    let buffer = words_buffer(&ctx, &[1; 4]);
    for _ in 0..20 {
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.fill_buffer(*buffer, 0, 16, 9).unwrap();
        cmd.push_label("left open");
    }
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.pop_label();
    cmd.push_label("left open too");
    ctx.submit(cmd).unwrap();
    assert_eq!(read_words(&ctx, *buffer, 4), [1; 4]);
}

/// A device whose messages the test reads after everything is gone.
fn watched() -> Option<(TestDevice, ValidationSink)> {
    let sink = ValidationSink::default();
    let device = device_with(|desc| desc.validation_sink = Some(sink.clone()))?;
    Some((device, sink))
}

#[test]
fn the_context_may_go_before_what_it_made() {
    let Some((ctx, sink)) = watched() else { return };
    let buffer = words_buffer(&ctx, &[1; 4]);
    let texture = ctx.create_texture(&TextureDesc { data: Some(&[1; 4]), ..Default::default() }).unwrap();
    let pipeline = compute_pipeline(&ctx, "layout(local_size_x = 1) in; void main() {}");
    let mut submitted = ctx.acquire_command_buffer().unwrap();
    submitted.fill_buffer(*buffer, 0, 16, 1).unwrap();
    ctx.submit(submitted).unwrap();
    let mut open = ctx.acquire_command_buffer().unwrap();
    open.fill_buffer(*buffer, 0, 16, 2).unwrap();
    open.bind_compute_pipeline(*pipeline).unwrap();
    open.dispatch([1, 1, 1], &Dependencies { buffers: &[*buffer], ..Default::default() }).unwrap();
    drop(ctx);
    open.fill_buffer(*buffer, 0, 16, 3).unwrap();
    drop((texture, pipeline));
    open.fill_buffer(*buffer, 0, 16, 4).unwrap();
    drop(buffer);
    drop(open);
    assert!(sink.is_empty(), "{:?}", sink.messages());
}

#[test]
fn a_command_buffer_may_be_the_last_to_go() {
    let Some((ctx, sink)) = watched() else { return };
    let buffer = words_buffer(&ctx, &[1; 4]).release();
    let texture =
        ctx.create_texture(&TextureDesc { data: Some(&[1; 4]), ..Default::default() }).unwrap().release();
    let mut open = ctx.acquire_command_buffer().unwrap();
    open.clear_texture(texture, ClearValue::Color([0.0; 4]), &TextureRange::default()).unwrap();
    drop(ctx);
    open.fill_buffer(buffer, 0, 16, 2).unwrap();
    drop(open);
    assert!(sink.is_empty(), "{:?}", sink.messages());
}

#[test]
fn a_context_ends_well_with_released_objects_and_uploads_that_never_ran() {
    let Some((ctx, sink)) = watched() else { return };
    let made = objects(&ctx);
    let clone = Context::clone(&ctx);
    ctx.wait_idle().unwrap();
    drop(ctx);
    clone.upload_buffer(made.buffer, 0, &[7; 12]).unwrap();
    clone.upload_texture(made.texture, &TextureRegion::default(), &[7; 4]).unwrap();
    clone.destroy(made.sampler);
    drop(clone);
    assert!(sink.is_empty(), "{:?}", sink.messages());
}

#[test]
fn buffers_are_listed_by_their_addresses() {
    let Some(ctx) = device() else { return };
    let create = |debug_name| {
        ctx.create_buffer(&BufferDesc { size_bytes: 64, debug_name, ..Default::default() }).unwrap()
    };
    let (first, second) = (create("first"), create("second"));
    let names = |range: std::ops::Range<u64>| {
        ctx.buffers_at(&range).into_iter().map(|found| (found.kind, found.name)).collect::<Vec<_>>()
    };
    let address = ctx.buffer_address(*first).unwrap();
    let expected = [("buffer", "first".to_owned())];
    assert_eq!(names(address..address + 1), expected);
    assert_eq!(names(address + 63..address + 64), expected);
    assert_eq!(names(0..u64::MAX).len(), 2);
    assert_eq!((names(address..address), names(0..16)), (Vec::new(), Vec::new()));
    drop(first);
    assert_eq!(names(address..address + 1), []);
    assert_eq!(names(0..u64::MAX), [("buffer", "second".to_owned())]);
    drop(second);
}

#[test]
fn live_objects_are_listed_and_reported_by_name() {
    lvk_tests::warnings::capture_warnings();
    let Some(ctx) = device() else { return };
    assert_eq!(ctx.live_objects(), []);
    let named = |name| BufferDesc { size_bytes: 16, debug_name: name, ..Default::default() };
    let kept = ctx.create_buffer(&named("the leaked buffer")).unwrap();
    let again = ctx.create_buffer(&named("the leaked buffer")).unwrap();
    let gone = ctx.create_buffer(&named("gone")).unwrap();
    let sampler = SamplerDesc { debug_name: "the leaked sampler", ..Default::default() };
    let sampler = ctx.create_sampler(&sampler).unwrap();
    drop(gone);
    let live = |kind, name: &str| LiveObject { kind, name: name.to_owned() };
    let buffer = live("buffer", "the leaked buffer");
    assert_eq!(ctx.live_objects(), [buffer.clone(), buffer, live("sampler", "the leaked sampler")]);
    kept.release();
    again.release();
    sampler.release();
    drop(ctx);
    let reports = lvk_tests::warnings::take_warnings("the leaked buffer");
    let [report] = &reports[..] else { unreachable!("{reports:?}") };
    assert!(report.starts_with("3 objects were alive when their context ended"), "{report}");
    assert!(report.contains("2 buffer: 2 x 'the leaked buffer'"), "{report}");
    assert!(report.contains("1 sampler: 'the leaked sampler'"), "{report}");
}

/// The validation layer says the names it was given.
#[test]
fn names_reach_vulkan_where_a_tool_reads_them() {
    for (wish, expected) in [(None, true), (Some(true), true), (Some(false), false)] {
        let Some(ctx) = device_with(|desc| desc.debug_names = wish) else { return };
        let desc = BufferDesc { size_bytes: 64, debug_name: "read by the layer", ..Default::default() };
        let buffer = ctx.create_buffer(&desc).unwrap();
        let info = vk::BufferViewCreateInfo::default()
            .buffer(ctx.raw_buffer(*buffer).unwrap())
            .format(vk::Format::R32_UINT)
            .range(vk::WHOLE_SIZE);
        // SAFETY: the one fault, a buffer that texel views were not announced for, is what the layer is to find; drivers
        // do not look.
        unsafe {
            let view = ctx.raw_device().create_buffer_view(&info, None).unwrap();
            ctx.raw_device().destroy_buffer_view(view, None);
        }
        let messages = ctx.take_messages();
        if std::env::var("LVK_TEST_VALIDATION").as_deref() == Ok("off") {
            eprintln!("NOT TESTED, there is no validation layer");
            return;
        }
        assert!(!messages.is_empty());
        let named = messages.iter().any(|message| message.text.contains("read by the layer"));
        assert_eq!(named, expected, "{wish:?}: {messages:?}");
    }
}

#[test]
fn no_way_of_submission_takes_command_buffers_of_another_context() {
    let (Some(ctx), Some(other)) = (device(), device()) else { return };
    let theirs = || other.acquire_command_buffer().unwrap();
    let refused = |result: lvk::Result<lvk::SubmitHandle>| {
        let Err(Error::InvalidUsage { object, message }) = result else { unreachable!("{result:?}") };
        assert_eq!((&*object, &*message), ("submit", "the command buffer belongs to another context"));
    };
    refused(ctx.submit_in_background(theirs()));
    // SAFETY: there are no semaphores.
    refused(unsafe { ctx.submit_with(theirs(), &[], &[]) });
    let nothing = vk::Semaphore::null();
    let wait = lvk::RawWait { semaphore: nothing, value: 0, stages: vk::PipelineStageFlags2::ALL_COMMANDS };
    let signal = lvk::RawSignal { semaphore: nothing, value: 0 };
    for (waits, signals, words) in [
        (&[wait][..], &[][..], "semaphore 0 to wait for is null"),
        (&[], &[signal], "semaphore 0 to signal is null"),
    ] {
        let cmd = ctx.acquire_command_buffer().unwrap();
        // SAFETY: the semaphores are refused.
        match unsafe { ctx.submit_with(cmd, waits, signals) } {
            Err(Error::InvalidUsage { object, message }) => {
                assert!(object == "submit_with" && message.contains(words), "{object}: {message}");
            }
            other => unreachable!("{words}: {other:?}"),
        }
    }
}
