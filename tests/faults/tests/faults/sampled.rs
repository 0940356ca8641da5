//! Some faults of some programs, spread evenly: a sample of the whole sweeps.

use std::time::Duration;

use lvk_faults::fault::FaultError;
use lvk_faults::sweep::plan::SweepPlan;
use lvk_faults::sweep::report::sweep;
use lvk_faults::sweep::run::{Caches, Program};

use crate::{
    WINDOWED, assert_reached, assert_validated, clean, error_line, in_window, program, some, validated,
    varies,
};

/// Time of a sweep.
const SAMPLE: Duration = Duration::from_secs(40);

fn assert_no_flaws(line: &str, program: &Program, plan: &SweepPlan, budget: Duration) {
    let report = sweep(program, plan, budget).unwrap();
    println!("{line}: {report}");
    assert!(report.flawed.is_empty(), "{line}: {report}");
    // Programs whose number of calls differs from run to run may miss one.
    assert!(report.is_large_enough(usize::from(varies(line))), "too few faults: {line}: {report}");
}

#[test]
fn some_calls_of_the_hybrid_sample_fail() {
    let line = "hybrid --width 64 --height 36 --frames 1 --rt hardware --scene SCENE";
    assert_no_flaws(line, &program(line), &some(30), SAMPLE);
}

#[test]
fn some_calls_of_scenarios_fail() {
    for line in ["blas", "threads", "queues", "raw_device", "hot_reload", "pipelines", "interop"] {
        assert_no_flaws(line, &program(line), &some(12), SAMPLE / 2);
    }
}

#[test]
fn some_calls_fail_above_the_validation_layer() {
    for line in ["queues", "hot_reload"] {
        assert_validated(&clean(validated(line)));
        assert_no_flaws(line, &validated(line), &some(12), SAMPLE / 2);
    }
}

#[test]
fn some_calls_of_a_sample_in_a_window_fail() {
    let program = Program { tries_again: false, ..program(WINDOWED[0]) };
    let Some((_connection, _display, program)) = in_window(program) else { return };
    assert_no_flaws(WINDOWED[0], &program, &some(12), SAMPLE / 2);
}

#[test]
fn some_calls_fail_while_caches_are_written() {
    let line = "rtx_hello --width 64 --height 36 --frames 1 --rt hardware";
    let cold = Program { caches: Caches::Cold, ..program(line) };
    assert_no_flaws(line, &cold, &some(12), SAMPLE / 2);
}

#[test]
fn some_calls_of_a_window_fail() {
    let Some((_connection, _display, program)) = in_window(program("window")) else { return };
    let errors = vec![FaultError::SurfaceLost, FaultError::OutOfDate, FaultError::WindowInUse];
    assert_no_flaws("window", &program, &SweepPlan { errors, stays_out_of_date: true, ..some(12) }, SAMPLE);
}

/// A swapchain that stays out of date is made anew for each frame, and no frame is shown.
#[test]
fn frames_of_a_swapchain_that_stays_out_of_date_are_not_shown() {
    let Some((_connection, _display, program)) = in_window(program("window")) else { return };
    let program = clean(program);
    for call in ["vkAcquireNextImageKHR 1", "vkAcquireNextImageKHR 2", "vkQueuePresentKHR 1"] {
        let fault = format!("{call} out-of-date stays");
        let outcome = assert_reached(&program, &fault);
        let expected = "error: the swapchain 'swapchain of the scenario' stays out of date";
        assert!(error_line(&outcome).starts_with(expected), "{fault}: {}", outcome.stderr);
    }
}
