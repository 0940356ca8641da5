//! Timestamps: they rise, they are plausible, and a timestamp that was not written is absent.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::time::Instant;

use lvk::{Dependencies, Error, QueryPoolDesc};
use lvk_tests::compute::{busy_pipeline, words_buffer};
use lvk_tests::device;

#[test]
fn times_rise_and_stay_below_the_wall_clock() {
    let Some(ctx) = device() else { return };
    let pool = ctx
        .create_query_pool(&QueryPoolDesc { count: 4, debug_name: "times", ..Default::default() })
        .unwrap();
    assert_eq!(ctx.timestamps_ms(*pool, 0, 4).unwrap(), [None; 4]);
    let work = busy_pipeline(&ctx, 10000, "words.at[gl_GlobalInvocationID.x] = sum;");
    let words = words_buffer(&ctx, &[0; 4096]);
    let start = Instant::now();
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.write_timestamp(*pool, 0).unwrap();
    cmd.bind_compute_pipeline(*work).unwrap();
    cmd.push_constants(&ctx.buffer_address(*words).unwrap()).unwrap();
    cmd.dispatch([64, 1, 1], &Dependencies { buffers: &[*words], ..Default::default() }).unwrap();
    cmd.write_timestamp(*pool, 1).unwrap();
    cmd.write_timestamp(*pool, 3).unwrap();
    let done = ctx.submit(cmd).unwrap();
    ctx.wait(done).unwrap();
    let wall_ms = start.elapsed().as_secs_f64() * 1e3;
    let [before, after, never, last] = ctx.timestamps_ms(*pool, 0, 4).unwrap()[..] else { unreachable!() };
    let (before, after, last) = (before.unwrap(), after.unwrap(), last.unwrap());
    assert_eq!(never, None);
    assert!(before < after && after <= last, "{before} {after} {last}");
    assert!(last - before < wall_ms, "{} ms of {wall_ms} ms", last - before);
    assert_eq!(ctx.timestamps_ms(*pool, 1, 2).unwrap(), [Some(after), None]);
}

#[test]
fn queries_are_written_again_after_a_reset() {
    let Some(ctx) = device() else { return };
    let pool = ctx.create_query_pool(&QueryPoolDesc::default()).unwrap();
    let mut latest = 0.0;
    for round in 0..3 {
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.reset_queries(*pool, 0..2).unwrap();
        cmd.write_timestamp(*pool, round % 2).unwrap();
        let done = ctx.submit(cmd).unwrap();
        ctx.wait(done).unwrap();
        let times = ctx.timestamps_ms(*pool, 0, 2).unwrap();
        let time = times[round as usize % 2].unwrap();
        assert!(time > latest && times[1 - round as usize % 2].is_none(), "{times:?} after {latest}");
        latest = time;
    }
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.reset_queries(*pool, 0..2).unwrap();
    let done = ctx.submit(cmd).unwrap();
    ctx.wait(done).unwrap();
    assert_eq!(ctx.timestamps_ms(*pool, 0, 2).unwrap(), [None; 2]);
}

#[test]
fn queries_outside_of_the_pool_are_errors() {
    let Some(ctx) = device() else { return };
    let pool = ctx
        .create_query_pool(&QueryPoolDesc { count: 3, debug_name: "three", ..Default::default() })
        .unwrap();
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let refused = [
        cmd.write_timestamp(*pool, 3),
        cmd.write_timestamp(*pool, u32::MAX),
        cmd.reset_queries(*pool, 2..4),
        cmd.reset_queries(*pool, 4..4),
        ctx.timestamps_ms(*pool, 0, 4).map(drop),
        ctx.timestamps_ms(*pool, u32::MAX, 2).map(drop),
    ];
    for (index, result) in refused.into_iter().enumerate() {
        assert!(
            matches!(&result, Err(Error::InvalidUsage { object, .. }) if object == "three"),
            "{index}: {result:?}"
        );
    }
    cmd.reset_queries(*pool, 3..3).unwrap();
    assert_eq!(ctx.timestamps_ms(*pool, 3, 0).unwrap(), []);
    ctx.submit(cmd).unwrap();
}

#[test]
fn impossible_pools_are_errors() {
    let Some(ctx) = device() else { return };
    let make = |count| {
        ctx.create_query_pool(&QueryPoolDesc { count, debug_name: "odd one", ..Default::default() }).map(drop)
    };
    assert!(matches!(make(0), Err(Error::InvalidUsage { .. })));
    assert!(matches!(make(65_537), Err(Error::LimitExceeded { requested: 65_537, limit: 65_536, .. })));
    make(65_536).unwrap();
}
