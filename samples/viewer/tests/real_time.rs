//! Sequences in real time: each picture goes on from those before, as a window shows them.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::Path;
use std::process::Command;

use image::RgbaImage;
use lvk_samples::app::metrics;

/// Frames that the camera has moved for.
const LAST: u32 = 8;

/// Renders small pictures of the showcase, by ray queries in software, into `folder`.
fn render(folder: &Path, name: &str, args: &str) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_viewer"));
    command.args(["--width", "96", "--height", "54", "--rt", "software", "--validate", "--out"]);
    command.arg(folder.join(format!("{name}_#.png"))).args(args.split_whitespace());
    let output = command.env_remove("LVK_DEVICE").output().unwrap();
    let text = [&output.stdout[..], &output.stderr].map(String::from_utf8_lossy).concat();
    assert!(output.status.success(), "{args}: {text}");
}

fn picture(folder: &Path, name: &str, number: u32) -> RgbaImage {
    image::open(folder.join(format!("{name}_{number}.png"))).unwrap().into_rgba8()
}

/// The first picture knows no frame before. The last one has their light too, and is closer to the reference than a frame alone: by 4.0 dB, and by 2.9
/// while reflections in rough metal stayed behind the camera.
#[test]
fn pictures_in_motion_go_on_from_those_before() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    render(folder, "moving", &format!("--real-time --frames 0..{}", LAST + 1));
    render(folder, "alone", &format!("--samples 1 --frames 0..{}", LAST + 1));
    render(folder, "reference", &format!("--method pathtrace --samples 128 --frames {LAST}..{}", LAST + 1));
    assert!(picture(folder, "moving", 0) == picture(folder, "alone", 0), "the first frame");
    let reference = picture(folder, "reference", LAST);
    let [moving, alone] = ["moving", "alone"].map(|name| {
        let image = picture(folder, name, LAST);
        metrics::compare(&image, &reference, image.width(), image.height()).unwrap()
    });
    println!("in motion: {moving}\nalone: {alone}");
    assert!(moving.psnr >= alone.psnr + 3.5, "in motion: {moving}; alone: {alone}");
}
