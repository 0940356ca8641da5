//! Queues that run late and in a random order show a missing wait, which a driver with one Vulkan queue hides.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::test_hooks::with_unordered_queues;
use lvk::{Dependencies, Queue, QueueRequest};
use lvk_tests::compute::{read_words, words_buffer};
use lvk_tests::queues::{WORDS, bare_step, step, step_pipeline, stepped, submit_on};
use lvk_tests::{TestDevice, device_with};

/// Tries in which each order must come once.
const TRIES: u32 = 60;

fn unordered(seed: u64) -> Option<TestDevice> {
    with_unordered_queues(seed, || device_with(|desc| desc.queues = QueueRequest::Emulated))
}

#[test]
fn submissions_of_two_queues_end_late_and_in_either_order() {
    let Some(ctx) = unordered(3) else { return };
    let (mut firsts, mut late) = ([0; 2], 0);
    for _ in 0..TRIES {
        let handles = [Queue::Graphics, Queue::Compute].map(|queue| submit_on(&ctx, queue, |_| {}));
        late += u32::from(!ctx.is_done(handles[1]).unwrap());
        let first = loop {
            let done = handles.map(|handle| ctx.is_done(handle).unwrap());
            if done != [false; 2] {
                break done;
            }
        };
        firsts[0] += u32::from(first == [true, false]);
        firsts[1] += u32::from(first == [false, true]);
        ctx.wait_idle().unwrap();
    }
    assert!(late > 0 && firsts.iter().all(|count| *count > 0), "{late} are late, {firsts:?} are first");
}

/// A buffer that a dispatch reads and does not name is a missing wait; a named one is none.
#[test]
fn a_missing_dependency_shows_and_a_named_one_holds() {
    let Some(ctx) = unordered(5) else { return };
    let pipeline = step_pipeline(&ctx);
    let (old, new) = ([1; WORDS], [8; WORDS]);
    let mut wrong = [0; 2];
    for number in 0..2 * TRIES {
        let is_named = number % 2 == 0;
        let (from, to) = (words_buffer(&ctx, &old), words_buffer(&ctx, &[0; WORDS]));
        ctx.wait_idle().unwrap();
        submit_on(&ctx, Queue::Graphics, |cmd| {
            cmd.update_buffer(*from, 0, bytemuck::cast_slice(&new)).unwrap();
        });
        let buffers = [*from, *to];
        submit_on(&ctx, Queue::Compute, |cmd| match is_named {
            true => step(&ctx, cmd, *pipeline, buffers, number),
            false => {
                let written = Dependencies { buffers: &[*to], ..Default::default() };
                bare_step(&ctx, cmd, *pipeline, buffers, (number, &written));
            }
        });
        let found = read_words(&ctx, *to, WORDS);
        let is_new = found == stepped(&new, number);
        assert!(is_new || found == stepped(&old, number), "neither old nor new: {found:?}");
        wrong[usize::from(is_named)] += u32::from(!is_new);
    }
    assert!(wrong[0] > 0 && wrong[1] == 0, "{wrong:?} without and with the dependency");
}
