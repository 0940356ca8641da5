//! Image sequences: frame N depends on N alone, and Ctrl-C leaves complete images.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::Path;

use lvk::Context;
use lvk_samples::app::frame_name::FrameName;
use lvk_samples::app::headless::Headless;
use lvk_samples::app::interrupt::Interrupt;
use lvk_samples::app::progress::Progress;
use lvk_samples::app::sequence::{RenderReport, RenderRequest, render_frames};
use lvk_samples::hybrid::{HybridConfig, HybridRenderer, HybridSequence, Method};
use lvk_tests::device;
use lvk_tests::hybrid::{HybridHarness, paths};
use lvk_tests::scene_obj::obj_scene;

const SIZE: [u32; 2] = [64, 36];

/// The sample, set up anew as by a process of its own, plays some frames into a folder.
fn played(ctx: &Context, frames: &str, folder: &Path) -> RenderReport {
    let scene = obj_scene();
    let path = paths(ctx)[0];
    let config =
        HybridConfig { path, width: SIZE[0], height: SIZE[1], max_depth: 2, ..HybridConfig::default() };
    let renderer = HybridRenderer::new(ctx, &scene, &config).unwrap();
    let mut sequence = HybridSequence::new(renderer, &scene, 0, true);
    let request = RenderRequest {
        frames: frames.parse().unwrap(),
        warm_up: 0,
        frames_per_round: 7,
        size: SIZE,
        out: FrameName::new(&folder.join("frame_##.png")),
        resume: false,
    };
    request.check().unwrap();
    render_frames(
        &mut Headless::new(&mut sequence),
        &request,
        &mut Progress::hidden(),
        &Interrupt::without_handlers(),
    )
    .unwrap()
}

fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let mut files: Vec<_> = entries
        .map(|entry| (entry.file_name().into_string().unwrap(), std::fs::read(entry.path()).unwrap()))
        .collect();
    files.sort();
    files
}

#[test]
fn ranges_of_several_processes_make_the_same_sequence() {
    let Some(ctx) = device() else { return };
    let (whole, parts) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    assert_eq!(played(&ctx, "0..9", whole.path()).written, 9);
    played(&ctx, "4..9", parts.path());
    played(&ctx, "0..4", parts.path());
    let (whole, parts) = (files(whole.path()), files(parts.path()));
    assert_eq!(whole.len(), 9);
    let names = |files: &[(String, Vec<u8>)]| files.iter().map(|file| file.0.clone()).collect::<Vec<_>>();
    assert_eq!(names(&whole), names(&parts));
    assert!(whole == parts, "a frame depends on the range it is in");
    assert!(whole[0].1 == whole[7].1, "after a round of seven frames the first comes again");
    assert!(whole[0].1 != whole[1].1 && whole[1].1 != whole[6].1, "nothing moves");
}

#[test]
fn a_sequence_starts_with_the_image_of_its_camera() {
    let Some(ctx) = device() else { return };
    let folder = tempfile::tempdir().unwrap();
    let timings = played(&ctx, "0..1", folder.path()).timings;
    let scene = obj_scene();
    let way = (Method::Hybrid, paths(&ctx)[0]);
    let expected = HybridHarness::new(&ctx, &scene, way, SIZE, 2).render(&scene.cameras[0]);
    assert!(image::open(folder.path().join("frame_00.png")).unwrap().into_rgba8() == expected);
    let passes: Vec<&str> = timings.passes().collect();
    assert_eq!(passes, ["geometry pass", "ray pass"]);
}

#[cfg(unix)]
mod interrupted {
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};

    use lvk_samples::app::cli;
    use lvk_tests::subprocess::test_path;
    use rustix::process::{Pid, Signal, kill_process};

    use super::*;

    const FOLDER: &str = "LVK_TEST_SEQUENCE_FOLDER";

    /// A triangle before a wall.
    const OBJ: &str = "v -2 -2 0\nv 2 -2 0\nv 0 2 0\nv -9 -9 -3\nv 9 -9 -3\nv 9 9 -3\nv -9 9 -3\n\
                       f 1 2 3\nf 4 5 6 7\n";

    /// Runs the program of the sample in this process.
    fn program(folder: &Path) -> ! {
        std::fs::write(folder.join("scene.obj"), OBJ).unwrap();
        let out = folder.join("frames/frame_######.png");
        let mut words = vec!["hybrid".to_owned()];
        words.extend(
            "--frames 0..1000000 --width 48 --height 27 --depth 1 --scene".split(' ').map(str::to_owned),
        );
        words.extend([
            folder.join("scene.obj").display().to_string(),
            "--out".to_owned(),
            out.display().to_string(),
        ]);
        let status = cli::run::<HybridSequence>(&cli::parse::<HybridSequence>(words).unwrap());
        let is_interrupted = status == std::process::ExitCode::from(130);
        std::process::exit(if is_interrupted { 42 } else { 1 });
    }

    #[test]
    fn an_interrupted_program_leaves_whole_images_and_says_so() {
        if let Some(folder) = std::env::var_os(FOLDER) {
            program(Path::new(&folder));
        }
        if device().is_none() {
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let test = test_path(&an_interrupted_program_leaves_whole_images_and_says_so);
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args([test, "--exact", "--nocapture"])
            .env(FOLDER, folder.path())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let third = folder.path().join("frames/frame_000002.png");
        let deadline = Instant::now() + Duration::from_secs(300);
        while !third.exists() && Instant::now() < deadline && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(5));
        }
        kill_process(Pid::from_child(&child), Signal::INT).unwrap();
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(42), "{said}");
        assert!(said.contains("every picture written is whole") && said.contains("--resume"), "{said}");
        let written = files(&folder.path().join("frames"));
        assert!(written.len() >= 3);
        for (name, content) in written {
            assert!(name.starts_with("frame_") && name.ends_with(".png"), "{name} was left behind");
            let image = image::load_from_memory(&content).unwrap();
            assert_eq!((image.width(), image.height()), (48, 27), "{name}");
        }
    }
}
