//! The viewer's window as a user meets it, on an X server without a screen.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod drag_and_drop;
#[allow(dead_code, reason = "other tests use the rest")]
#[path = "../../../tests/windows/session.rs"]
mod session;

use std::path::Path;

use session::{
    BESIDE_PANEL, F1, SIZE, Session, assert_success, desktop, differing, read_image, sample, texts,
};

const VIEWER: &str = env!("CARGO_BIN_EXE_viewer");

#[test]
fn a_window_shows_what_a_sequence_does() {
    let Some(desktop) = desktop() else { return };
    let folder = tempfile::tempdir().unwrap();
    // Data, which is the same after any number of frames.
    let args = ["--view", "normals", "--bounces", "1"];
    let windowed = [&["--window", "--frames", "3", "--validate", "--out", "window.png"], &args[..]].concat();
    let mut program = sample(VIEWER, &windowed, folder.path());
    desktop.attach(&mut program);
    let output = program.output().unwrap();
    assert_success(&output);
    assert!(texts(&output).0.contains("validation messages: 0"), "{}", texts(&output).0);
    let headless = [&["--frames", "2..3", "--samples", "3", "--out", "frame_#.png"], &args[..]].concat();
    assert_success(&sample(VIEWER, &headless, folder.path()).output().unwrap());
    let image = |name: &str| read_image(&folder.path().join(name));
    let (window, frame) = (image("window.png"), image("frame_2.png"));
    assert_eq!(window.dimensions(), (SIZE[0], SIZE[1]));
    let beside = differing(&window, &frame, BESIDE_PANEL);
    assert!(beside < 0.02, "{beside} of the picture beside the panel");
    assert!(differing(&window, &frame, 0) > 0.1, "there is no panel");
}

/// A model that the overview of its box shows.
fn write_triangle(path: &Path, heights: [i32; 3]) {
    let [left, right, middle] = heights;
    std::fs::write(path, format!("v -1 {left} 0\nv 1 {right} 0\nv 0 {middle} 0\nf 1 2 3\n")).unwrap();
}

#[test]
fn files_are_dropped_on_a_window() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let (first, good, bad) = (path("first.obj"), path("a file.obj"), path("bad.glb"));
    write_triangle(&first, [0, 0, 2]);
    // Upside down.
    write_triangle(&good, [2, 2, 0]);
    std::fs::write(&bad, "glTF").unwrap();
    // Nothing in the first model moves, so any number of frames shows the same.
    let args = ["--view", "normals", "--bounces", "1", "first.obj"];
    let Some(mut session) = Session::new(VIEWER, &args, folder.path()) else { return };
    session.wait_for_line("loaded in");
    session.press(F1);
    session.take_screenshot(&path("viewer_window_0001.png"));
    let before = session.take_screenshot(&path("viewer_window_0002.png"));
    drag_and_drop::drop_file(&session, &bad);
    session.wait_for_line("warning: ");
    let still = session.take_screenshot(&path("viewer_window_0003.png"));
    // Each frame looks at other places within its pixels.
    let differs = differing(&before, &still, 0);
    assert!(differs < 0.05, "{differs} of the first model is no longer shown");
    drag_and_drop::drop_file(&session, &good);
    session.wait_for_line("uploading the model");
    session.shoot_until(&path("viewer_window_0004.png"), |_, image| differing(&before, image, 0) > 0.2);
    session.close();
}
