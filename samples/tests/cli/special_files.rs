//! Pipes, devices and huge files in place of files that the program reads and writes, and names that steer a terminal.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::program::{Desk, Outcome, TRIANGLE, assert_names, desk_with_device, hybrid};

/// Longest time of a run. A program that waits for the other end of a pipe never ends.
const PATIENCE: Duration = Duration::from_secs(120);

/// Runs the program with files for its output, and fails if it does not end by itself.
fn run(desk: &Desk, mut command: Command) -> Outcome {
    let [out, err] = ["out", "err"].map(|name| desk.input.path().join(name));
    command.stdout(fs::File::create(&out).unwrap()).stderr(fs::File::create(&err).unwrap());
    let mut child = command.spawn().unwrap();
    let begun = Instant::now();
    let status = loop {
        match child.try_wait().unwrap() {
            Some(status) => break status,
            None if begun.elapsed() < PATIENCE => std::thread::sleep(Duration::from_millis(20)),
            None => {
                child.kill().unwrap();
                child.wait().unwrap();
                panic!("the program hangs: {}", fs::read_to_string(&err).unwrap());
            }
        }
    };
    let text = |path| fs::read_to_string(path).unwrap();
    Outcome { status: status.code(), out: text(out), err: crate::program::without_driver_note(&text(err)) }
}

fn pipe(desk: &Desk, name: &str) -> PathBuf {
    let path = desk.input.path().join(name);
    assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
    path
}

fn huge(desk: &Desk, name: &str) -> PathBuf {
    let path = desk.input.path().join(name);
    fs::File::create(&path).unwrap().set_len(1 << 40).unwrap();
    path
}

fn text(path: &Path) -> String {
    path.display().to_string()
}

#[test]
fn pipes_devices_and_huge_files_are_refused_as_scene_and_cameras() {
    let desk = Desk::new();
    let scene = desk.file("triangle.obj", TRIANGLE);
    let cases = [
        (pipe(&desk, "pipe"), "a named pipe"),
        (PathBuf::from("/dev/zero"), "a device"),
        (PathBuf::from("/dev/tty"), "a device"),
        (huge(&desk, "huge"), "1099511627776 bytes, more than the"),
    ];
    for (path, reason) in cases {
        let path = text(&path);
        run(&desk, desk.command(&["--scene", &path])).assert_error(2, &["cannot read", &path, reason]);
        run(&desk, desk.command(&["--scene", &scene, "--cameras", &path]))
            .assert_error(2, &["cannot read", &path, reason]);
    }
}

#[test]
fn pipes_and_devices_are_refused_as_pictures_before_any_work() {
    let desk = Desk::new();
    let absent = text(&desk.input.path().join("absent.obj"));
    for (path, reason) in [(pipe(&desk, "out.png"), "a named pipe"), (PathBuf::from("/dev/zero"), "a device")]
    {
        let command = hybrid(&["--scene", &absent, "--out", &text(&path)]);
        run(&desk, command).assert_error(2, &["cannot write", &text(&path), reason]);
    }
}

#[test]
fn a_scene_comes_from_standard_input_where_it_is_asked_for() {
    let Some((desk, scene)) = desk_with_device() else { return };
    let mut command = desk.command(&["--scene", "/dev/stdin", "--rt", "software"]);
    command.stdin(Stdio::from(fs::File::open(scene).unwrap()));
    run(&desk, command).assert_success();
    let mut endless = desk.command(&["--cameras", "/dev/stdin", "--scene", "/dev/null.obj"]);
    endless.stdin(Stdio::from(fs::File::open("/dev/zero").unwrap()));
    run(&desk, endless).assert_error(2, &["/dev/stdin", "more than the 1048576 bytes"]);
}

#[test]
fn files_that_a_scene_names_are_warned_of_and_not_waited_for() {
    let Some((desk, _)) = desk_with_device() else { return };
    pipe(&desk, "pipe.mtl");
    pipe(&desk, "pipe.png");
    huge(&desk, "huge.mtl");
    desk.file("a.mtl", "newmtl a\nmap_Kd pipe.png\nnewmtl b\nmap_Kd /dev/zero\n");
    let faces = "usemtl a\nf 1 2 3\nusemtl b\nf 3 2 1\n";
    let libraries = "mtllib pipe.mtl\nmtllib huge.mtl\nmtllib /dev/zero\nmtllib a.mtl\n";
    let scene = desk.file("a.obj", format!("{libraries}v 0 0 0\nv 1 0 0\nv 0 1 0\n{faces}"));
    let outcome = run(&desk, desk.command(&["--scene", &scene, "--rt", "software"]));
    outcome.assert_success();
    assert_names(
        &outcome.err,
        &["pipe.mtl", "a named pipe", "huge.mtl", "more than the 67108864", "/dev/zero"],
    );
    assert_names(&outcome.err, &["pipe.png", "magenta checks stand in"]);
}

#[test]
fn a_pipe_in_place_of_a_cache_is_replaced() {
    let Some((desk, scene)) = desk_with_device() else { return };
    let cache = desk.input.path().join("kept");
    fs::create_dir(&cache).unwrap();
    let pipelines = pipe(&desk, "kept/hybrid.pipelines");
    let mut command = desk.command(&["--scene", &scene, "--rt", "software"]);
    command.env("LVK_CACHE", &cache);
    let outcome = run(&desk, command);
    outcome.assert_success();
    assert_names(&outcome.err, &["the pipeline cache", "hybrid.pipelines", "a named pipe"]);
    assert!(pipelines.is_file());
}

#[test]
fn a_truncated_picture_is_warned_of() {
    let Some((desk, _)) = desk_with_device() else { return };
    let mut jpeg = std::io::Cursor::new(Vec::new());
    let image = image::RgbImage::from_fn(256, 256, |x, y| image::Rgb([x as u8, y as u8, (x * y) as u8]));
    image.write_to(&mut jpeg, image::ImageFormat::Jpeg).unwrap();
    let jpeg = jpeg.into_inner();
    desk.file("half.jpg", &jpeg[..jpeg.len() / 2]);
    desk.file("a.mtl", "newmtl a\nmap_Kd half.jpg\n");
    let scene = desk.file("a.obj", format!("mtllib a.mtl\nusemtl a\n{TRIANGLE}"));
    let outcome = run(&desk, desk.command(&["--scene", &scene, "--rt", "software"]));
    outcome.assert_success();
    assert_names(&outcome.err, &["warning: picture ", "half.jpg", "cut off", "grey"]);
}

#[test]
fn names_that_steer_a_terminal_are_escaped_and_long_ones_shortened() {
    let Some((desk, _)) = desk_with_device() else { return };
    let long = "n".repeat(1 << 20);
    let names = format!("usemtl a\u{1b}[2J\nf 1 2 3\nusemtl b\u{202e}gnp\nf 3 2 1\nusemtl {long}\nf 2 1 3\n");
    let scene =
        desk.file("a.obj", format!("mtllib c\u{9b}.mtl\nmtllib {long}\nv 0 0 0\nv 1 0 0\nv 0 1 0\n{names}"));
    let outcome = run(&desk, desk.command(&["--scene", &scene, "--rt", "software"]));
    outcome.assert_success();
    for printed in [&outcome.out, &outcome.err] {
        let steers = |c: char| c != '\n' && c.is_control() || c == '\u{202e}';
        assert!(!printed.contains(steers), "{printed:?}");
        assert!(printed.len() < 10_000, "{}", printed.len());
    }
    assert_names(&outcome.err, &["a\\u{1b}[2J", "b\\u{202e}gnp", "c\\u{9b}.mtl", "(1048576 bytes)"]);

    let absent = desk.run(&["--scene", "absent\u{1b}]0;title\u{7}.obj"]);
    absent.assert_error(2, &["absent\\u{1b}]0;title\\u{7}.obj"]);
    for word in ["\u{7}\u{1b}[31mred", &long[..100_000]] {
        let usage = desk.run(&["--frames", word]);
        usage.assert_usage_error(&["--frames"]);
        assert!(!usage.err.contains(['\u{1b}', '\u{7}']) && usage.err.len() < 20_000, "{:.500}", usage.err);
    }
}
