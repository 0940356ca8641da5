//! The profiler: its tree equals the recorded scopes, and it never waits.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::time::Instant;

use lvk::{
    ColorAttachment, CommandBuffer, ComputePipelineHandle, Context, Dependencies, Format, GpuProfile,
    GpuScope, Holder, RenderPassDesc,
};
use lvk_tests::compute::{busy_pipeline, words_buffer};
use lvk_tests::device;
use lvk_tests::raster::target;

/// A pipeline whose dispatch takes a while.
fn work(ctx: &Context) -> Holder<ComputePipelineHandle> {
    busy_pipeline(ctx, 4000, "words.at[gl_GlobalInvocationID.x] = sum;")
}

/// Runs it inside of a scope with this name.
fn scoped(cmd: &mut CommandBuffer, name: &str, inside: impl FnOnce(&mut CommandBuffer)) {
    cmd.push_label(name);
    inside(cmd);
    cmd.pop_label();
}

/// Names and nesting.
fn shape(scopes: &[GpuScope]) -> String {
    let one = |scope: &GpuScope| match scope.children.is_empty() {
        true => scope.name.clone(),
        false => format!("{}({})", scope.name, shape(&scope.children)),
    };
    scopes.iter().map(one).collect::<Vec<_>>().join(" ")
}

/// Scopes follow each other inside of `start..end`.
fn assert_nested(scopes: &[GpuScope], start: f64, end: f64) {
    let mut last = start;
    for scope in scopes {
        let done = scope.start_ms + scope.ms;
        assert!(
            scope.ms >= 0.0 && scope.start_ms >= last - 1e-6 && done <= end + 1e-6,
            "{scope:?} in {start}..{end}"
        );
        assert_nested(&scope.children, scope.start_ms, done);
        last = done;
    }
}

fn check(profile: &GpuProfile, expected: &str) {
    assert_eq!(shape(&profile.scopes), expected);
    assert_nested(&profile.scopes, 0.0, profile.ms);
}

#[test]
fn the_tree_is_the_recorded_nesting() {
    let Some(ctx) = device() else { return };
    let (work, words) = (work(&ctx), words_buffer(&ctx, &[0; 4096]));
    let color = target(&ctx, Format::Rgba8Unorm, [16, 16]);
    let run = |cmd: &mut CommandBuffer| {
        cmd.bind_compute_pipeline(*work).unwrap();
        cmd.push_constants(&ctx.buffer_address(*words).unwrap()).unwrap();
        cmd.dispatch([64, 1, 1], &Dependencies { buffers: &[*words], ..Default::default() }).unwrap();
    };
    ctx.wait_idle().unwrap();
    ctx.set_profiling(true).unwrap();
    let start = Instant::now();
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.pop_label();
    scoped(&mut cmd, "simulate", |cmd| {
        scoped(cmd, "move", run);
        scoped(cmd, "sort", |cmd| scoped(cmd, "count", run));
        run(cmd);
    });
    cmd.insert_label("a place");
    cmd.push_label("render");
    let targets = [ColorAttachment::clear(*color, [0.0; 4])];
    let desc = RenderPassDesc { color: &targets, debug_name: "pass", ..Default::default() };
    let mut pass = cmd.begin_rendering(&desc).unwrap();
    pass.push_label("opaque");
    pass.pop_label();
    pass.pop_label();
    pass.push_label("left open");
    pass.insert_label("a place");
    drop(pass);
    cmd.push_label("left open too");
    let done = ctx.submit(cmd).unwrap();
    ctx.wait(done).unwrap();
    let wall_ms = start.elapsed().as_secs_f64() * 1e3;
    let profile = ctx.last_profile().unwrap().unwrap();
    check(&profile, "simulate(move sort(count)) render(pass(opaque left open) left open too)");
    assert_eq!(profile.frame, None);
    assert!(profile.ms > 0.0 && profile.ms < wall_ms, "{} of {wall_ms}", profile.ms);
    let simulate = &profile.scopes[0];
    assert!(simulate.ms > simulate.children.iter().map(|child| child.ms).sum());
    assert!(simulate.children.iter().all(|child| child.ms > 0.0), "{profile}");
    assert!(profile.to_string().contains("count"));
}

#[test]
fn nothing_is_measured_while_it_is_off() {
    let Some(ctx) = device() else { return };
    let submit = |name: &str| {
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.push_label(name);
        ctx.wait(ctx.submit(cmd).unwrap()).unwrap();
    };
    submit("before");
    assert_eq!(ctx.last_profile().unwrap(), None);
    ctx.set_profiling(true).unwrap();
    submit("on");
    ctx.set_profiling(false).unwrap();
    submit("after");
    check(&ctx.last_profile().unwrap().unwrap(), "on");
}

#[test]
fn many_scopes_and_cancelled_command_buffers_are_handled() {
    let Some(ctx) = device() else { return };
    ctx.set_profiling(true).unwrap();
    for round in 0..4 {
        let mut given_up = ctx.acquire_command_buffer().unwrap();
        given_up.push_label("given up");
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        let names: Vec<_> = (0..31 + round).map(|number| format!("{round}.{number}")).collect();
        for name in &names {
            scoped(&mut cmd, name, |_| {});
        }
        drop(given_up);
        ctx.wait(ctx.submit(cmd).unwrap()).unwrap();
        check(&ctx.last_profile().unwrap().unwrap(), &names.join(" "));
    }
}

#[test]
fn frames_in_flight_keep_their_scopes_apart() {
    let Some(ctx) = device() else { return };
    let (work, words) = (work(&ctx), words_buffer(&ctx, &[0; 4096]));
    ctx.set_profiling(true).unwrap();
    let mut seen = None;
    for _ in 0..200 {
        let frame = ctx.next_frame().unwrap();
        for part in 0..=frame.number % 3 {
            let mut cmd = ctx.acquire_command_buffer().unwrap();
            scoped(&mut cmd, &format!("f{}.{part}", frame.number), |cmd| {
                cmd.bind_compute_pipeline(*work).unwrap();
                cmd.push_constants(&ctx.buffer_address(*words).unwrap()).unwrap();
                cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*words], ..Default::default() }).unwrap();
            });
            ctx.submit(cmd).unwrap();
        }
        ctx.upload_buffer(*words, 0, &[0; 4]).unwrap();
        let Some(profile) = ctx.last_profile().unwrap() else { continue };
        let number = profile.frame.unwrap();
        let names: Vec<_> = (0..=number % 3).map(|part| format!("f{number}.{part}")).collect();
        check(&profile, &names.join(" "));
        assert!(number < frame.number && number + 1 + ctx.frames_in_flight() as u64 >= frame.number);
        assert!(seen <= Some(number));
        seen = Some(number);
    }
    ctx.wait_idle().unwrap();
    ctx.next_frame().unwrap();
    assert_eq!(ctx.last_profile().unwrap().unwrap().frame, Some(199));
}

/// The frame needs no successor, and work that it submits after a wait is added to its profile.
#[test]
fn a_wait_for_the_gpu_finishes_the_last_frame() {
    let Some(ctx) = device() else { return };
    ctx.set_profiling(true).unwrap();
    let submit = |name: &str| {
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        scoped(&mut cmd, name, |_| {});
        ctx.submit(cmd).unwrap();
    };
    let expect = |number: u64, expected: &str| {
        let profile = ctx.last_profile().unwrap().unwrap();
        assert_eq!(profile.frame, Some(number));
        check(&profile, expected);
    };
    for number in 0..10 {
        ctx.next_frame().unwrap();
        submit(&format!("f{number}"));
    }
    ctx.wait_idle().unwrap();
    expect(9, "f9");
    submit("after the wait");
    ctx.wait_idle().unwrap();
    expect(9, "f9 after the wait");
    ctx.wait_idle().unwrap();
    expect(9, "f9 after the wait");
    ctx.next_frame().unwrap();
    expect(9, "f9 after the wait");
    ctx.next_frame().unwrap();
    ctx.wait_idle().unwrap();
    expect(9, "f9 after the wait");
}

#[test]
fn threads_are_profiled_side_by_side() {
    let Some(ctx) = device() else { return };
    ctx.set_profiling(true).unwrap();
    std::thread::scope(|threads| {
        for thread in 0..4 {
            let ctx = &*ctx;
            threads.spawn(move || {
                for _ in 0..50 {
                    let mut cmd = ctx.acquire_command_buffer().unwrap();
                    scoped(&mut cmd, &format!("t{thread}"), |cmd| scoped(cmd, "inner", |_| {}));
                    ctx.submit(cmd).unwrap();
                    ctx.last_profile().unwrap();
                }
            });
        }
    });
    ctx.wait_idle().unwrap();
    let profile = ctx.last_profile().unwrap().unwrap();
    assert!(profile.scopes.len() == 1 && shape(&profile.scopes[0].children) == "inner", "{profile}");
}
