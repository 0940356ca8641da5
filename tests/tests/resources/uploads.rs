//! Uploads and readbacks: merged and in order, without a submission each, from many threads, in bounded memory.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::ops::Range;

use lvk::test_hooks::{staging_bytes, submissions, waiting_objects};
use lvk::{
    BufferDesc, BufferHandle, Context, Dependencies, Error, Format, Holder, MemoryKind, SubmitHandle,
    TextureDesc, TextureRegion, TextureUsage,
};
use lvk_tests::compute::{Evaluator, compute_pipeline, read_words, words_buffer};
use lvk_tests::noise::noise;
use lvk_tests::random::Random;
use lvk_tests::{device, device_with};

fn empty_buffer(ctx: &Context, size_bytes: u64) -> Holder<BufferHandle> {
    ctx.create_buffer(&BufferDesc { size_bytes, debug_name: "target", ..Default::default() }).unwrap()
}

fn download(ctx: &Context, buffer: BufferHandle, size: usize) -> Vec<u8> {
    let mut bytes = vec![0; size];
    ctx.download_buffer(buffer, 0, &mut bytes).unwrap();
    bytes
}

#[test]
fn objects_are_created_and_filled_without_a_submission_or_a_wait() {
    let Some(ctx) = device() else { return };
    ctx.wait_idle().unwrap();
    let before = submissions(&ctx);
    let buffers: Vec<_> = (0..1000_u32).map(|word| words_buffer(&ctx, &[word; 64])).collect();
    let texels = [7_u8; 64];
    let desc = TextureDesc {
        format: Format::Rgba8Unorm,
        extent: [4, 4],
        data: Some(&texels),
        ..TextureDesc::default()
    };
    let textures: Vec<_> = (0..50).map(|_| ctx.create_texture(&desc).unwrap()).collect();
    let bare: Vec<_> =
        (0..50).map(|_| ctx.create_texture(&TextureDesc { data: None, ..desc }).unwrap()).collect();
    assert_eq!(submissions(&ctx), before);
    ctx.wait_idle().unwrap();
    assert_eq!(submissions(&ctx), before + 1, "all of it is one submission");
    for (word, buffer) in (0..1000).zip(&buffers).step_by(111) {
        assert_eq!(read_words(&ctx, **buffer, 64), [word; 64]);
    }
    assert_eq!(ctx.download_texture(*textures[49], &TextureRegion::default()).unwrap(), texels);
    drop(bare);
}

/// Random places and sizes: single bytes, neighbours, overlaps, several buffers in turns, more than the budget.
#[test]
fn ten_thousand_mixed_uploads_leave_what_the_last_of_each_byte_said() {
    const SIZES: [usize; 3] = [1_000, 70_001, 400_000];
    let Some(ctx) = device_with(|desc| desc.staging_bytes = 2 << 20) else { return };
    let buffers = SIZES.map(|size| empty_buffer(&ctx, size as u64));
    let mut expected = SIZES.map(|size| vec![0_u8; size]);
    for (buffer, size) in buffers.iter().zip(SIZES) {
        ctx.upload_buffer(**buffer, 0, &vec![0; size]).unwrap();
    }
    let mut random = Random::new(5);
    let mut below = |most: usize| (random.between(0.0, 1.0) * most as f32) as usize % most.max(1);
    let bytes = noise(3, 2_000);
    let mut last_end = [0; 3];
    for number in 0..10_000_usize {
        let which = below(3);
        let size = [1, 4, 64, 2_000][below(4)].min(SIZES[which]);
        let follows = number % 3 == 0 && last_end[which] + size <= SIZES[which];
        let offset = if follows { last_end[which] } else { below(SIZES[which] - size + 1) };
        let from = below(bytes.len() - size + 1);
        let part = &bytes[from..from + size];
        ctx.upload_buffer(*buffers[which], offset as u64, part).unwrap();
        expected[which][offset..offset + size].copy_from_slice(part);
        last_end[which] = offset + size;
        if number % 3_000 == 2_999 {
            ctx.submit(ctx.acquire_command_buffer().unwrap()).unwrap();
        }
    }
    for (buffer, expected) in buffers.iter().zip(&expected) {
        assert!(download(&ctx, **buffer, expected.len()) == *expected);
    }
}

#[test]
fn texture_uploads_keep_their_order_where_they_overlap() {
    let Some(ctx) = device() else { return };
    let format = Format::R8Uint;
    let desc = TextureDesc { format, extent: [16, 16], mips: 2, ..TextureDesc::default() };
    let textures = [(); 2].map(|()| ctx.create_texture(&desc).unwrap());
    let mut expected = [[0_u8; 256]; 2];
    for (texture, number) in textures.iter().zip(0_u8..) {
        ctx.upload_texture(**texture, &TextureRegion::default(), &[number; 256]).unwrap();
        let small = TextureRegion { mip: 1, ..TextureRegion::default() };
        ctx.upload_texture(**texture, &small, &[40 + number; 64]).unwrap();
        expected[usize::from(number)] = [number; 256];
    }
    for step in 0..30_u8 {
        let which = usize::from(step % 2);
        let (x, y) = (u32::from(step % 9), u32::from(step * 5 % 11));
        let region = TextureRegion { offset: [x, y], extent: [6, 4], ..TextureRegion::default() };
        ctx.upload_texture(*textures[which], &region, &[100 + step; 24]).unwrap();
        for row in y..y + 4 {
            let start = (row * 16 + x) as usize;
            expected[which][start..start + 6].fill(100 + step);
        }
    }
    for (number, texture) in textures.iter().enumerate() {
        let found = ctx.download_texture(**texture, &TextureRegion::default()).unwrap();
        assert_eq!(found, expected[number]);
        let small = TextureRegion { mip: 1, ..TextureRegion::default() };
        assert_eq!(ctx.download_texture(**texture, &small).unwrap(), [40 + number as u8; 64]);
    }
}

#[test]
fn staging_memory_stays_within_its_bounds_however_much_goes_through_it() {
    const STAGING: u64 = 1 << 20;
    let Some(ctx) = device_with(|desc| desc.staging_bytes = STAGING) else { return };
    let target = empty_buffer(&ctx, 1 << 20);
    let (bytes, mut most) = (noise(9, 50_000), 0);
    for number in 0..400_u64 {
        ctx.upload_buffer(*target, number * 997 % 900_000, &bytes).unwrap();
        most = most.max(staging_bytes(&ctx));
    }
    assert!(most <= 3 * STAGING, "{most} bytes");
    let expected = noise(1, 1 << 20);
    ctx.upload_buffer(*target, 0, &expected).unwrap();
    assert!(download(&ctx, *target, 1 << 20) == expected);
    ctx.wait_idle().unwrap();
    assert!(staging_bytes(&ctx) <= 2 * STAGING, "{} bytes are kept", staging_bytes(&ctx));
}

#[test]
fn an_upload_reaches_what_was_recorded_before_and_destroyed_since() {
    let Some(ctx) = device() else { return };
    let copy = compute_pipeline(
        &ctx,
        "layout(local_size_x = 64) in;
         layout(buffer_reference, scalar) buffer Words { uint at[]; };
         layout(push_constant, scalar) uniform Push { Words source; Words target; };
         void main() { target.at[gl_LocalInvocationID.x] = source.at[gl_LocalInvocationID.x]; }",
    );
    let result = words_buffer(&ctx, &[0; 64]);
    let source = empty_buffer(&ctx, 256);
    let push = [*source, *result].map(|buffer| ctx.buffer_address(buffer).unwrap());
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*copy).unwrap();
    cmd.push_constants(&push).unwrap();
    cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*result], ..Default::default() }).unwrap();
    ctx.upload_buffer(*source, 0, bytemuck::cast_slice(&[5_u32; 64])).unwrap();
    drop(source);
    ctx.submit(cmd).unwrap();
    assert_eq!(read_words(&ctx, *result, 64), [5; 64]);
}

#[test]
fn objects_destroyed_after_an_upload_do_not_wait_for_a_submission() {
    let Some(ctx) = device() else { return };
    ctx.wait_idle().unwrap();
    let kept = words_buffer(&ctx, &[1; 64]);
    let idle = waiting_objects(&ctx).unwrap();
    let before = submissions(&ctx);
    for _ in 0..20 {
        drop(words_buffer(&ctx, &[2; 64]));
        let desc = TextureDesc { extent: [4, 4], usage: TextureUsage::SAMPLED, ..TextureDesc::default() };
        drop(ctx.create_texture(&desc).unwrap());
    }
    assert_eq!((waiting_objects(&ctx).unwrap(), submissions(&ctx)), (idle, before));
    assert_eq!(read_words(&ctx, *kept, 64), [1; 64]);
}

#[test]
fn eight_threads_upload_to_buffers_of_their_own_and_to_one_of_all() {
    const THREADS: usize = 8;
    const PART: usize = 40_000;
    let Some(ctx) = device_with(|desc| desc.staging_bytes = 1 << 20) else { return };
    let shared = empty_buffer(&ctx, (THREADS * PART) as u64);
    std::thread::scope(|scope| {
        for thread in 0..THREADS {
            let (ctx, shared) = (&*ctx, *shared);
            scope.spawn(move || {
                let own = empty_buffer(ctx, PART as u64);
                for round in 0..12 {
                    let bytes = noise((thread * 100 + round) as u32, PART);
                    for (at, part) in (0_u64..).step_by(1_000).zip(bytes.chunks(1_000)) {
                        ctx.upload_buffer(*own, at, part).unwrap();
                        ctx.upload_buffer(shared, (thread * PART) as u64 + at, part).unwrap();
                    }
                    if round % 4 == 3 {
                        assert!(download(ctx, *own, PART) == bytes, "thread {thread}, round {round}");
                    }
                }
            });
        }
    });
    let found = download(&ctx, *shared, THREADS * PART);
    for (thread, part) in found.chunks(PART).enumerate() {
        assert!(part == noise((thread * 100 + 11) as u32, PART), "thread {thread}");
    }
}

#[test]
fn bytes_are_read_later_as_they_were_when_they_were_asked_for() {
    let Some(ctx) = device() else { return };
    for memory in [MemoryKind::Device, MemoryKind::HostVisible] {
        let data = noise(1, 1_000);
        let desc = BufferDesc { data: Some(&data), memory, ..BufferDesc::default() };
        let buffer = ctx.create_buffer(&desc).unwrap();
        let asked = ctx.read_buffer_later(*buffer, 10..610).unwrap();
        assert!(asked.submission() > SubmitHandle::default());
        if memory == MemoryKind::Device {
            ctx.upload_buffer(*buffer, 0, &[0; 1_000]).unwrap();
        }
        drop(buffer);
        ctx.wait_idle().unwrap();
        assert!(asked.is_ready().unwrap());
        assert_eq!(asked.wait().unwrap(), &data[10..610]);
        assert_eq!(asked.clone().wait().unwrap(), &data[10..610], "as often as one likes");
    }
    let texels = noise(2, 64);
    let desc =
        TextureDesc { format: Format::R8Unorm, extent: [8, 8], data: Some(&texels), ..Default::default() };
    let texture = ctx.create_texture(&desc).unwrap();
    let asked = ctx.read_texture_later(*texture, &TextureRegion::default()).unwrap();
    drop(texture);
    assert_eq!(asked.wait().unwrap(), texels);
    assert!(asked.is_ready().unwrap());
}

#[test]
fn empty_and_cancelled_readbacks_are_harmless() {
    let Some(ctx) = device() else { return };
    let buffer = words_buffer(&ctx, &[3; 16]);
    let nothing = ctx.read_buffer_later(*buffer, 64..64).unwrap();
    assert!(nothing.is_ready().unwrap());
    assert!(nothing.wait().unwrap().is_empty());
    for _ in 0..10 {
        drop(ctx.read_buffer_later(*buffer, 0..64).unwrap());
    }
    ctx.wait_idle().unwrap();
    assert_eq!(waiting_objects(&ctx).unwrap(), 0);
}

#[test]
fn uploads_and_readbacks_outside_of_an_object_are_errors() {
    let Some(ctx) = device() else { return };
    let buffer = words_buffer(&ctx, &[3; 16]);
    let usage = |result: lvk::Result<lvk::Readback>| match result {
        Err(Error::InvalidUsage { .. }) => {}
        other => unreachable!("{other:?}"),
    };
    let reversed = ctx.read_buffer_later(*buffer, Range { start: 8, end: 4 }).unwrap_err();
    assert_eq!(reversed.to_string(), "words: the range 8..4 of bytes ends before it begins");
    usage(ctx.read_buffer_later(*buffer, Range { start: 8, end: 4 }));
    usage(ctx.read_buffer_later(*buffer, 0..65));
    usage(ctx.read_buffer_later(*buffer, 65..65));
    usage(ctx.read_buffer_later(*buffer, u64::MAX - 1..u64::MAX));
    let too_far = ctx.upload_buffer(*buffer, 63, &[0; 2]);
    assert!(matches!(too_far, Err(Error::InvalidUsage { .. })));
    let texture = ctx.create_texture(&TextureDesc { extent: [4, 4], ..Default::default() }).unwrap();
    let mip = TextureRegion { mip: 1, ..TextureRegion::default() };
    usage(ctx.read_texture_later(*texture, &mip));
    let gone = *buffer;
    drop(buffer);
    assert!(matches!(ctx.read_buffer_later(gone, 0..4), Err(Error::StaleHandle { .. })));
    assert!(matches!(ctx.upload_buffer(gone, 0, &[1]), Err(Error::StaleHandle { .. })));
    let evaluator = Evaluator::new(&ctx, "vec4(i)");
    assert_eq!(evaluator.run(&ctx, [0; 3], 2, &Dependencies::default())[1], [1.0; 4]);
}
