//! Submission: waiting, polling, and frames in flight.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{Dependencies, Error, Format, Queue, SubmitHandle, TextureDesc, TextureUsage};
use lvk_tests::compute::{busy_pipeline, read_words, words_buffer};
use lvk_tests::{device, device_with};

#[test]
fn a_submission_is_done_after_waiting_for_it() {
    let Some(ctx) = device() else { return };
    assert!(ctx.is_done(SubmitHandle::default()).unwrap());
    let mut submissions = Vec::new();
    for _ in 0..5 {
        submissions.push(ctx.submit(ctx.acquire_command_buffer().unwrap()).unwrap());
    }
    assert!(submissions.windows(2).all(|pair| pair[0] < pair[1]));
    ctx.wait(submissions[4]).unwrap();
    for submission in submissions {
        assert!(ctx.is_done(submission).unwrap());
        ctx.wait(submission).unwrap();
    }
}

#[test]
fn submissions_of_another_context_are_errors() {
    let (Some(ctx), Some(other)) = (device(), device()) else { return };
    let foreign = other.submit(other.acquire_command_buffer().unwrap()).unwrap();
    for _ in 0..3 {
        assert!(matches!(ctx.wait(foreign), Err(Error::InvalidUsage { .. })));
        assert!(matches!(ctx.is_done(foreign), Err(Error::InvalidUsage { .. })));
        ctx.submit(ctx.acquire_command_buffer().unwrap()).unwrap();
    }
    other.wait(foreign).unwrap();
}

#[test]
fn flushing_runs_uploads_and_is_idle_without_any() {
    let Some(ctx) = device() else { return };
    ctx.wait_idle().unwrap();
    let idle = ctx.flush().unwrap();
    assert_eq!(ctx.flush().unwrap(), idle);
    let buffer = words_buffer(&ctx, &[0; 4]);
    ctx.upload_buffer(*buffer, 0, bytemuck::cast_slice(&[3_u32; 4])).unwrap();
    let flushed = ctx.flush().unwrap();
    assert!(flushed > idle);
    ctx.wait(flushed).unwrap();
    assert_eq!(read_words(&ctx, *buffer, 4), [3; 4]);
}

/// The next command buffer of the queue may be the same one of Vulkan. NVIDIA's driver 580.159 runs a `vkCmdUpdateBuffer` of one that is
/// reset while it is recorded.
#[test]
fn a_dropped_command_buffer_leaves_nothing_to_the_next() {
    let Some(ctx) = device() else { return };
    let (buffer, other) = (words_buffer(&ctx, &[7; 4]), words_buffer(&ctx, &[9; 4]));
    for queue in Queue::ALL {
        for command in 0..3 {
            let mut dropped = ctx.acquire_command_buffer_on(queue).unwrap();
            match command {
                0 => dropped.update_buffer(*buffer, 0, &[1; 8]).unwrap(),
                1 => dropped.copy_buffer(*other, 0, *buffer, 0, 16).unwrap(),
                _ => dropped.fill_buffer(*buffer, 0, 16, 3).unwrap(),
            }
            drop(dropped);
            ctx.submit(ctx.acquire_command_buffer_on(queue).unwrap()).unwrap();
            assert_eq!(read_words(&ctx, *buffer, 4), [7; 4], "{queue:?}, command {command}");
        }
    }
}

#[test]
fn destroyed_textures_submit_nothing() {
    let Some(ctx) = device() else { return };
    let come_and_go = || {
        let desc = TextureDesc {
            format: Format::Rgba8Unorm,
            extent: [4, 4],
            usage: TextureUsage::SAMPLED,
            ..Default::default()
        };
        drop(ctx.create_texture(&desc).unwrap());
    };
    ctx.wait_idle().unwrap();
    let idle = ctx.flush().unwrap();
    (0..10).for_each(|_| come_and_go());
    assert_eq!(ctx.flush().unwrap(), idle);
    let open = ctx.acquire_command_buffer().unwrap();
    come_and_go();
    assert!(ctx.flush().unwrap() > idle, "what is being recorded may read it");
    ctx.submit(open).unwrap();
}

#[test]
fn frames_count_up_and_round() {
    for (asked, in_flight) in [(0, 1), (1, 1), (3, 3), (100, 8)] {
        let Some(ctx) = device_with(|desc| desc.frames_in_flight = asked) else { return };
        assert_eq!(ctx.frames_in_flight(), in_flight);
        for number in 0..20 {
            let frame = ctx.next_frame().unwrap();
            assert_eq!((frame.number, frame.index), (number, number as usize % in_flight));
        }
    }
}

#[test]
fn a_frame_starts_when_the_gpu_is_done_with_the_last_of_its_index() {
    let Some(ctx) = device_with(|desc| desc.frames_in_flight = 3) else { return };
    let work = busy_pipeline(&ctx, 20000, "words.at[gl_GlobalInvocationID.x] += 1 + (sum & 0);");
    let words = words_buffer(&ctx, &[0; 64]);
    let mut last = [SubmitHandle::default(); 3];
    for _ in 0..30 {
        let frame = ctx.next_frame().unwrap();
        assert!(ctx.is_done(last[frame.index]).unwrap(), "frame {}", frame.number);
        for _ in 0..2 {
            let mut cmd = ctx.acquire_command_buffer().unwrap();
            cmd.bind_compute_pipeline(*work).unwrap();
            cmd.push_constants(&ctx.buffer_address(*words).unwrap()).unwrap();
            cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*words], ..Default::default() }).unwrap();
            last[frame.index] = ctx.submit(cmd).unwrap();
        }
    }
    assert_eq!(read_words(&ctx, *words, 64), [60; 64]);
}
