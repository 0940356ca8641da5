//! Loading in a window: progress, errors, hot reload, and windows that cannot be opened.

use std::fs;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use crate::session::{F1, PATIENCE, SIZE, SPACE, Session, desktop, differing, sample, texts};

/// Starts a sample that loads for some seconds; `None` where windows are not tested.
fn loading_session(folder: &Path) -> Option<Session> {
    let args = ["--triangles", "400000", "--samples", "1", "--depth", "0"];
    let mut session = Session::new(env!("CARGO_BIN_EXE_large_scene"), &args, folder)?;
    session.wait_for_line("making the valley");
    Some(session)
}

#[test]
fn a_sample_goes_on_loading_in_another_window() {
    let folder = tempfile::tempdir().unwrap();
    let Some(mut session) = loading_session(folder.path()) else { return };
    let shot = |number: u32| folder.path().join(format!("large_scene_window_{number:04}.png"));
    let loading = session.take_screenshot(&shot(1));
    session.reopen();
    frames_while_loading(&mut session);
    session.press(F1);
    let picture = session.take_screenshot(&shot(2));
    assert!(differing(&loading, &picture, 0) > 0.9, "there is no picture");
    session.close();
}

/// Waits until a sample is loaded and returns the number of frames shown meanwhile.
fn frames_while_loading(session: &mut Session) -> u32 {
    let mut frames = None;
    let deadline = Instant::now() + PATIENCE;
    while frames.is_none() {
        let line = session.said.recv_timeout(deadline.saturating_duration_since(Instant::now())).unwrap();
        let rest = line.split_once("loaded in").and_then(|(_, rest)| rest.split_once("with "));
        frames = rest.and_then(|(_, rest)| rest.split_once(" frames")?.0.parse().ok());
    }
    frames.unwrap()
}

#[test]
fn a_window_displays_loading_progress_and_answers_keys_meanwhile() {
    let folder = tempfile::tempdir().unwrap();
    let Some(mut session) = loading_session(folder.path()) else { return };
    let shot = |number: u32| folder.path().join(format!("large_scene_window_{number:04}.png"));
    // The progress fades in.
    thread::sleep(Duration::from_millis(500));
    let loading = session.take_screenshot(&shot(1));
    let background = loading.get_pixel(2, 2);
    let share = |is: &dyn Fn(&image::Rgba<u8>) -> bool| {
        loading.pixels().filter(|pixel| is(pixel)).count() as f64 / f64::from(SIZE[0] * SIZE[1])
    };
    let (bare, bright) = (share(&|pixel| pixel == background), share(&|pixel| pixel[1] > 120));
    assert!((0.2..0.95).contains(&bare), "{bare} of the window is bare");
    assert!(bright > 1e-3, "{bright} of the window is bright: no progress is to be read");
    session.wait_for_line("building acceleration structures");
    let frames = frames_while_loading(&mut session);
    assert!(frames > 5, "{frames} frames");
    session.press(F1);
    let picture = session.take_screenshot(&shot(2));
    assert!(differing(&loading, &picture, 0) > 0.9, "there is no picture yet");
    session.close();
}

#[test]
fn a_window_closes_while_it_loads_and_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let program = env!("CARGO_BIN_EXE_large_scene");
    let stages = ["making the valley", "uploading the scene", "building acceleration structures"];
    for (number, stage) in stages.into_iter().enumerate() {
        let Some(mut session) = Session::new(program, &["--triangles", "1000000"], folder.path()) else {
            return;
        };
        session.wait_for_line(stage);
        let said = session.close();
        // The first stage takes so long anywhere that the others are not come to.
        let later = if number == 0 { &stages[1..] } else { &[] };
        let wrong = [&["warning", "error", "alive"], later].concat();
        let is_wrong = |line: &&String| wrong.iter().any(|word| line.contains(word));
        assert_eq!(said.iter().find(is_wrong), None, "{stage}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn load_errors_are_those_of_a_start_without_a_window() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("bad.obj"), "v 0 0 0\nf 1 2 3\n").unwrap();
    for args in [
        &["--scene", "nowhere.obj"][..],
        &["--scene", "bad.obj"],
        &["--layout", "combined", "--triangles", "400000", "--copies", "2000"],
    ] {
        // One for each, as a server begins anew when the last program has gone.
        let Some(desktop) = desktop() else { return };
        let run = |window: &[&str]| {
            let mut command =
                sample(env!("CARGO_BIN_EXE_large_scene"), &[window, args].concat(), folder.path());
            desktop.attach(&mut command);
            let output = command.output().unwrap();
            let (_, err) = texts(&output);
            let error = err.lines().find(|line| line.starts_with("error: ")).map(str::to_owned);
            (output.status.code(), error.unwrap_or(err))
        };
        let (status, error) = run(&["--window"]);
        assert_eq!((status, &error), (Some(2), &run(&[]).1), "{args:?}");
    }
}

#[test]
fn shaders_are_compiled_as_they_change_and_wrong_ones_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let shaders = folder.path().join("shaders");
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shaders");
    for part in ["rtx_hello", "common"] {
        fs::create_dir_all(shaders.join(part)).unwrap();
        for entry in fs::read_dir(source.join(part)).unwrap() {
            let path = entry.unwrap().path();
            fs::copy(&path, shaders.join(part).join(path.file_name().unwrap())).unwrap();
        }
    }
    let program = env!("CARGO_BIN_EXE_rtx_hello");
    let Some(mut session) = Session::new(program, &["--hot-reload", "shaders"], folder.path()) else {
        return;
    };
    let shot = |number: u32| folder.path().join(format!("rtx_hello_window_{number:04}.png"));
    session.press(SPACE);
    session.press(F1);
    let before = session.take_screenshot(&shot(1));
    let view = shaders.join("rtx_hello/view.glsl");
    let text = fs::read_to_string(&view).unwrap();
    fs::write(&view, text.replace("sqrt(corners)", "sqrt(corner)")).unwrap();
    session.wait_for_line("corner");
    assert!(session.take_screenshot(&shot(2)) == before, "the old pipeline stays");
    fs::write(&view, text.replace("sqrt(corners)", "vec3(1.0, 0.0, 0.0)")).unwrap();
    session.wait_for_line("shaders compiled anew");
    let red = session.take_screenshot(&shot(3));
    assert!(differing(&before, &red, 0) > 0.05, "the new shader is not in use");
    session.close();
}

/// winit panics then, which is no way to end a program.
#[test]
fn a_window_without_keyboard_descriptions_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let Some(desktop) = desktop() else { return };
    let mut command = sample(env!("CARGO_BIN_EXE_hello_triangle"), &["--window"], folder.path());
    desktop.attach(&mut command);
    for variable in ["XKB_CONFIG_ROOT", "XKB_CONFIG_EXTRA_PATH", "XDG_CONFIG_HOME", "HOME"] {
        command.env(variable, folder.path().join("nowhere"));
    }
    let output = command.output().unwrap();
    let (_, err) = texts(&output);
    assert_eq!(output.status.code(), Some(1), "{err}");
    assert!(err.contains("no window can be opened") && err.contains("xkb-data"), "{err}");
    assert!(!err.contains("panicked"), "{err}");
}

#[test]
fn windows_that_cannot_be_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (args, status, part) in [
        (&["--window"][..], 1, "no window can be opened"),
        (&["--window", "--frames", "0..4"], 2, "--frames 100"),
        (&["--window", "--hot-reload", "nowhere"], 2, "no such folder"),
        (&["--hot-reload"], 2, "--window"),
        (&["--window", "--out", "nowhere/a.png"], 2, "nowhere"),
    ] {
        let output = sample(env!("CARGO_BIN_EXE_rtx_hello"), args, folder.path()).output().unwrap();
        let (out, err) = texts(&output);
        assert_eq!(output.status.code(), Some(status), "{args:?}: {out}{err}");
        assert!(err.contains(part), "{args:?}: {err}");
    }
}
