//! The tests: a short run under validation, an hour of frames, and a leak that must be found.

use lvk_tests::subprocess::output_of_subprocess;

use super::run::{HOUR, Report, Soak};
use super::scene::CYCLE;

/// Actions that every run must have done, as a loop that does nothing is flat as well.
const ACTIONS: [&str; 25] = [
    "frames",
    "draws",
    "dispatches that trace rays",
    "BLAS refits",
    "TLAS updates",
    "TLAS created and destroyed",
    "BLAS created and destroyed",
    "compactions",
    "textures created",
    "textures unloaded",
    "mips streamed",
    "uploads on the graphics queue",
    "uploads on the compute queue",
    "uploads on the transfer queue",
    "readbacks compared",
    "pictures compared with the first",
    "resizes of targets",
    "hot reloads",
    "hot reloads of ray tracing pipelines",
    "traces by pipelines",
    "traces by pipelines compared",
    "stale handles refused",
    "transient heaps created and destroyed",
    "frames with the profiler",
    "compute pipelines compiled in the background and destroyed",
];

/// Actions of runs with a window.
const WINDOW_ACTIONS: [&str; 3] = ["presents", "swapchain resizes", "swapchains created and destroyed"];

/// True if the frames are presented in a window.
fn has_window() -> bool {
    #[cfg(target_os = "linux")]
    return lvk_tests::windows::desktop().is_some();
    #[cfg(not(target_os = "linux"))]
    false
}

fn check(report: &Report) {
    report.print();
    let of_window: &[&str] = if has_window() { &WINDOW_ACTIONS } else { &[] };
    for action in ACTIONS.iter().chain(of_window) {
        assert!(report.tally.count_of(action) > 0, "not done: {action}");
    }
    let violations = report.samples.violations(report.warm_up);
    assert!(violations.is_empty(), "{}", violations.join("\n"));
}

/// In a process of its own, as threads and files of other tests would count.
#[test]
fn counts_are_flat_under_validation() {
    let output = output_of_subprocess(counts_are_flat_under_validation, &[], || {
        let soak = Soak { frames: 8 * CYCLE, sample_every: CYCLE, validation: true, leak_every: None };
        if let Some(report) = soak.run() {
            check(&report.unwrap());
        }
    });
    if let Some(output) = output {
        println!("{output}");
    }
}

/// One buffer in 500 frames, of thousands of objects that come and go; and 64 bytes a frame.
#[test]
fn a_leak_on_purpose_is_detected() {
    output_of_subprocess(a_leak_on_purpose_is_detected, &[], || {
        let (frames, leak_every) = (8 * CYCLE, Some(2 * CYCLE));
        let soak = Soak { frames, sample_every: CYCLE, validation: false, leak_every };
        let Some(report) = soak.run() else { return };
        let report = report.unwrap();
        assert_eq!(report.tally.count_of("buffers leaked on purpose"), 4);
        let violations = report.samples.violations(report.warm_up);
        for name in ["live: buffer: ", "bytes: objects in heap", "process: bytes of Rust's heap: "] {
            assert!(violations.iter().any(|line| line.starts_with(name)), "{name} in {violations:#?}");
        }
    });
}

/// As many frames as `LVK_SOAK_FRAMES` says, an hour of them by default.
#[test]
#[ignore = "takes many minutes: .ci/slow soak"]
fn an_hour_of_frames() {
    let frames = std::env::var("LVK_SOAK_FRAMES").ok().map_or(HOUR, |text| text.parse().unwrap());
    // About 72 samples, at least eight.
    let sample_every = CYCLE * (frames / CYCLE / 72).max(1);
    let soak = Soak { frames, sample_every, validation: false, leak_every: None };
    if let Some(report) = soak.run() {
        check(&report.unwrap());
    }
}
