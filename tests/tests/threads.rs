//! Threads: a context is shared by all of them, and command buffers move between them.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    BufferHandle, CommandBuffer, Context, Dependencies, Format, Holder, SubmitHandle, TextureDesc,
    ValidationSink,
};
use lvk_tests::compute::{Evaluator, read_vec4, read_words, vec4_buffer, words_buffer};
use lvk_tests::device;

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
