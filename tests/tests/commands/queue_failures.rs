//! Submissions that the driver refuses: the library waits for what was submitted before, does not wait for the rest,
//! and frees nothing that the GPU still uses. The validation layer would report it.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::sync::Arc;
use std::sync::mpsc::channel;
use std::thread::spawn;
use std::time::Duration;

use lvk::test_hooks::{
    fail_submission_after, refuse_and_run_submission_after, set_waits_time_out, waiting_objects,
    with_fault_injection,
};
use lvk::{Context, Error, Queue, SubmitHandle, TextureDesc, TextureUsage};
use lvk_tests::compute::words_buffer;
use lvk_tests::queues::{REQUESTS, WORDS, submit_on};
use lvk_tests::{TestDevice, device_with};

/// Runs a test with each way to have queues, each kept in a context whose submissions can fail.
fn each(test: impl Fn(&Arc<TestDevice>)) {
    for queues in REQUESTS {
        let Some(ctx) = with_fault_injection(|| device_with(|desc| desc.queues = queues)) else { return };
        test(&Arc::new(ctx));
    }
}

/// Asserts that a submission was refused.
fn refused(result: lvk::Result<SubmitHandle>) {
    assert!(matches!(result, Err(Error::OutOfDeviceMemory { .. })), "{result:?}");
}

/// Asserts that everything ends that the context waits for.
fn ends(ctx: &Arc<TestDevice>, wait: impl Fn(&Context) -> lvk::Result<()> + Send + 'static) {
    let (done, answer) = channel();
    let waiting = Arc::clone(ctx);
    let thread = spawn(move || {
        let answer = wait(&waiting);
        drop(waiting);
        done.send(answer)
    });
    answer.recv_timeout(Duration::from_secs(60)).unwrap().unwrap();
    thread.join().unwrap().unwrap();
}

#[test]
fn no_wait_hangs_on_a_submission_that_failed() {
    each(|ctx| {
        let words = words_buffer(ctx, &[7; WORDS]);
        for refusing in Queue::ALL {
            let before = Queue::ALL.map(|queue| submit_on(ctx, queue, |_| {}));
            let mut cmd = ctx.acquire_command_buffer_on(refusing).unwrap();
            cmd.fill_buffer(*words, 0, 256, 1).unwrap();
            if refusing != Queue::Transfer {
                ctx.submit(cmd).unwrap();
                continue;
            }
            fail_submission_after(0);
            refused(ctx.submit(cmd));
            refused(ctx.submit(ctx.acquire_command_buffer().unwrap()));
            ends(ctx, move |ctx| before.into_iter().try_for_each(|submission| ctx.wait(submission)));
        }
        ends(ctx, Context::wait_idle);
        drop(words);
        assert_eq!(waiting_objects(ctx).unwrap(), 0);
    });
}

/// Several queues: an upload is submitted by itself, and the command buffer behind it fails.
#[test]
fn submissions_before_the_failure_are_kept_until_they_are_done() {
    each(|ctx| {
        ctx.set_profiling(true).unwrap();
        let words = words_buffer(ctx, &[7; 1 << 20]);
        for queue in [Queue::Compute, Queue::Graphics] {
            submit_on(ctx, queue, |_| {});
            ctx.upload_buffer(*words, 0, &[1; 4 << 20]).unwrap();
        }
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.fill_buffer(*words, 0, 256, 1).unwrap();
        fail_submission_after(1);
        let first = ctx.submit(cmd);
        // On one queue both went out together.
        refused(if first.is_ok() { ctx.submit(ctx.acquire_command_buffer().unwrap()) } else { first });
        ends(ctx, Context::wait_idle);
        drop(words);
        assert_eq!(waiting_objects(ctx).unwrap(), 0);
    });
}

/// An image leaves its queue, and the command buffer that wants it fails.
#[test]
fn an_image_that_left_its_queue_is_kept_until_it_is_done() {
    each(|ctx| {
        let usage = TextureUsage::SAMPLED | TextureUsage::STORAGE;
        let desc = TextureDesc { extent: [64, 64], usage, ..Default::default() };
        let image = ctx.create_texture(&desc).unwrap();
        let clear = |cmd: &mut lvk::CommandBuffer| {
            cmd.clear_texture(*image, lvk::ClearValue::Color([1.0; 4]), &Default::default()).unwrap();
        };
        submit_on(ctx, Queue::Compute, clear);
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        clear(&mut cmd);
        fail_submission_after(1);
        let first = ctx.submit(cmd);
        refused(if first.is_ok() { ctx.submit(ctx.acquire_command_buffer().unwrap()) } else { first });
        ends(ctx, Context::wait_idle);
        drop(image);
        assert_eq!(waiting_objects(ctx).unwrap(), 0);
    });
}

/// A driver may run a part of what it refuses: its command buffers are kept until the GPU is done.
#[test]
fn command_buffers_of_a_refused_submission_may_run() {
    each(|ctx| {
        let words = words_buffer(ctx, &[7; 1 << 24]);
        ctx.wait_idle().unwrap();
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.fill_buffer(*words, 0, 4 << 24, 1).unwrap();
        refuse_and_run_submission_after(0);
        refused(ctx.submit(cmd));
        ends(ctx, Context::wait_idle);
        // The words live until the end of the context, as what the refused commands use has no value to wait for.
        std::mem::forget(words);
    });
}

/// No driver ends a wait without a limit by a timeout. If one did, the work would not be done.
#[test]
fn a_wait_that_times_out_is_an_error() {
    each(|ctx| {
        let words = words_buffer(ctx, &[7; WORDS]);
        let submission = submit_on(ctx, Queue::Graphics, |cmd| cmd.fill_buffer(*words, 0, 256, 1).unwrap());
        set_waits_time_out(true);
        let waited = ctx.wait(submission);
        set_waits_time_out(false);
        let Err(Error::Vulkan { call, result, .. }) = waited else { unreachable!("{waited:?}") };
        assert_eq!((call, result), ("vkWaitSemaphores", lvk::ash::vk::Result::TIMEOUT));
        ctx.wait(submission).unwrap();
    });
}
