//! Samples in a window: their first frames, before and after it changes its size.

use std::path::Path;
use std::process::ExitCode;

use crate::run_sample;

/// Width of the window, whose left part the panel covers.
const WIDTH: u32 = 416;
const HEIGHT: u32 = 64;
/// The first column beside the panel, which shows times.
const BESIDE_PANEL: u32 = 352;

/// Shows three frames of a sample, and writes the part of the last that is beside the panel.
pub(crate) fn run(name: &str, args: &[String], result: &Path) -> Result<(), ExitCode> {
    let whole = result.with_file_name("window.png");
    let size = ["--window", "--frames", "3", "--width", &WIDTH.to_string(), "--height", &HEIGHT.to_string()]
        .map(str::to_owned);
    let ran = run_sample(name, &[args, &size].concat(), &whole);
    let kept = ran.and_then(|()| {
        let beside = image::open(&whole)
            .map(|image| image.crop_imm(BESIDE_PANEL, 0, image.width() - BESIDE_PANEL, image.height()));
        beside.and_then(|image| image.save(result)).map_err(|error| {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        })
    });
    // A picture of a run that has failed may be there.
    let _ = std::fs::remove_file(&whole);
    kept
}
