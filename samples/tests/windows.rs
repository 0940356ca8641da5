//! The samples' windows as a user meets them, on an X server without a screen.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod missing_features;
mod window_session;

use std::fs;
use std::path::Path;
use std::thread;
use std::time::Duration;

use image::RgbaImage;
use window_session::{
    F1, KEY_N, KEY_W, SIZE, SPACE, Session, assert_success, desktop, read_image, sample, texts,
};

/// An x coordinate to the right of the panel.
const BESIDE_PANEL: u32 = 352;

/// Share of the pixels right of `first` in which two pictures differ by more than rounding.
fn differing(one: &RgbaImage, other: &RgbaImage, first: u32) -> f64 {
    differing_by(1, one, other, first)
}

/// The same by more than so many steps of a channel.
fn differing_by(steps: u8, one: &RgbaImage, other: &RgbaImage, first: u32) -> f64 {
    assert_eq!(one.dimensions(), other.dimensions());
    let pairs: Vec<_> =
        one.enumerate_pixels().zip(other.pixels()).filter(|((x, ..), _)| *x >= first).collect();
    let differs = |((.., a), b): &&((u32, u32, &image::Rgba<u8>), &image::Rgba<u8>)| {
        a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > steps)
    };
    pairs.iter().filter(differs).count() as f64 / pairs.len() as f64
}

/// Shows a few frames, and compares the last with the same frame of a sequence without a window.
fn prints_what_it_writes(program: &str, args: &[&str]) {
    let Some(desktop) = desktop() else { return };
    let folder = tempfile::tempdir().unwrap();
    let windowed = [&["--window", "--frames", "3", "--validate", "--out", "window.png"], args].concat();
    let mut shown = sample(program, &windowed, folder.path());
    desktop.attach(&mut shown);
    let output = shown.output().unwrap();
    assert_success(&output);
    assert!(texts(&output).0.contains("validation messages: 0"), "{}", texts(&output).0);
    let headless = [&["--frames", "2..3", "--out", "frame_#.png"], args].concat();
    assert_success(&sample(program, &headless, folder.path()).output().unwrap());
    let (window, frame) =
        (read_image(&folder.path().join("window.png")), read_image(&folder.path().join("frame_2.png")));
    assert_eq!(window.dimensions(), (SIZE[0], SIZE[1]));
    let beside = differing(&window, &frame, BESIDE_PANEL);
    assert!(beside < 1e-3, "{beside} of the picture beside the panel");
    assert!(differing(&window, &frame, 0) > 0.1, "there is no panel");
}

/// Declares a test for each row: its name, the program, and arguments.
macro_rules! windows_print_what_they_write {
    ($($test:ident: $program:literal, $args:expr;)*) => {
        $(#[test]
        fn $test() {
            prints_what_it_writes(env!(concat!("CARGO_BIN_EXE_", $program)), $args);
        })*
    };
}

windows_print_what_they_write! {
    deferred_has_a_window: "deferred", &["--lights", "60"];
    hello_triangle_has_a_window: "hello_triangle", &[];
    render_to_cube_map_has_a_window: "render_to_cube_map", &["--face-size", "64"];
    omni_shadows_has_a_window: "omni_shadows", &["--show-cube"];
    yuv_has_a_window: "yuv", &[];
    triplanar_has_a_window: "triplanar", &[];
    rtx_hello_has_a_window: "rtx_hello", &[];
    rtx_textures_has_a_window: "rtx_textures", &[];
    rtx_pipeline_has_a_window: "rtx_pipeline", &[];
    rtx_ao_has_a_window: "rtx_ao", &["--passes", "1"];
    sponza_has_a_window: "sponza", &["--shadow-size", "512"];
    large_scene_has_a_window: "large_scene", &["--triangles", "20000", "--copies", "30", "--samples", "1"];
    hybrid_has_a_window: "hybrid", &["--depth", "1"];
    hybrid_oit_has_a_window: "hybrid_oit", &["--supersampling", "1"];
    reflections_has_a_window: "reflections", &["--samples", "1"];
}

#[test]
fn mesh_shaders_has_a_window() {
    let program = env!("CARGO_BIN_EXE_mesh_shaders");
    let folder = tempfile::tempdir().unwrap();
    match missing_features::mesh_shaders(sample(program, &["--frames", "1"], folder.path())) {
        None => prints_what_it_writes(program, &[]),
        Some(lack) => eprintln!("NOT TESTED, {lack}"),
    }
}

#[test]
fn keys_hide_the_panel_and_fly_and_the_image_follows_the_window() {
    let folder = tempfile::tempdir().unwrap();
    let program = env!("CARGO_BIN_EXE_rtx_textures");
    let Some(mut session) = Session::new(program, &[], folder.path()) else { return };
    let shot = |number: u32| folder.path().join(format!("rtx_textures_window_{number:04}.png"));
    session.press(SPACE);
    // The first frame lays the panel out and does not show it.
    session.take_screenshot(&shot(1));
    let with_panel = session.take_screenshot(&shot(2));
    session.press(F1);
    let without = session.take_screenshot(&shot(3));
    assert!(differing(&with_panel, &without, BESIDE_PANEL) < 1e-3, "the animation stands");
    assert!(differing(&with_panel, &without, 0) > 0.1, "the panel is still there");
    session.key(KEY_W, true);
    thread::sleep(Duration::from_millis(500));
    session.key(KEY_W, false);
    let flown = session.take_screenshot(&shot(4));
    assert!(differing(&without, &flown, 0) > 0.1, "nothing has moved");
    session.resize([300, 260]);
    thread::sleep(Duration::from_millis(600));
    assert_eq!(session.take_screenshot(&shot(5)).dimensions(), (300, 260));
    session.close();
}

#[test]
fn an_animation_by_frames_stands_too() {
    let folder = tempfile::tempdir().unwrap();
    let program = env!("CARGO_BIN_EXE_hello_triangle");
    let Some(mut session) = Session::new(program, &["--frames", "1000000"], folder.path()) else { return };
    let shot = |number: u32| folder.path().join(format!("hello_triangle_window_{number:04}.png"));
    session.press(F1);
    let (first, second) = (session.take_screenshot(&shot(1)), session.take_screenshot(&shot(2)));
    assert!(differing(&first, &second, 0) > 0.0, "it stands already");
    session.press(SPACE);
    let first = session.take_screenshot(&shot(3));
    assert!(session.take_screenshot(&shot(4)) == first, "it goes on");
    session.press(SPACE);
    assert!(session.take_screenshot(&shot(5)) != first, "it still stands");
    session.close();
}

#[test]
fn a_window_displays_loading_progress_and_answers_keys_meanwhile() {
    let folder = tempfile::tempdir().unwrap();
    let program = env!("CARGO_BIN_EXE_large_scene");
    let args = ["--triangles", "400000", "--samples", "1", "--depth", "0"];
    let Some(mut session) = Session::new(program, &args, folder.path()) else { return };
    let shot = |number: u32| folder.path().join(format!("large_scene_window_{number:04}.png"));
    session.wait_for_line("making the valley");
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
    let frames = session.frames_while_loading();
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
fn what_cannot_be_loaded_is_said_as_without_a_window() {
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

/// Sizes without a pattern, the same in each run: up to 400 pixels, and each eighth one up to 4.
fn sizes(count: u32) -> impl Iterator<Item = [u32; 2]> {
    let mut state = 0x9e37_79b9_u32;
    let mut below = move |end: u32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) % end
    };
    (0..count).map(move |number| {
        let end = if number % 8 == 5 { 4 } else { 400 };
        [1 + below(end), 1 + below(end)]
    })
}

/// A screenshot of a size tells that frames have it, and that no swapchain is being made: a window that changes while one
/// is made, between the question for its size and the answer, causes a message of the validation layer that no application can prevent.
#[test]
fn two_hundred_sizes_of_a_window_are_followed() {
    let folder = tempfile::tempdir().unwrap();
    let program = env!("CARGO_BIN_EXE_hello_triangle");
    let Some(mut session) = Session::new(program, &[], folder.path()) else { return };
    let shot = folder.path().join("hello_triangle_window_0001.png");
    session.press(SPACE);
    session.press(F1);
    for (number, size) in sizes(200).enumerate() {
        session.resize(size);
        session.shoot_until(&shot, |_, shot| shot.dimensions() == size.into());
        if number % 40 == 39 {
            // By then the picture has the size too, and stands still.
            thread::sleep(Duration::from_millis(300));
            session.shoot_until(&shot, |session, shot| {
                shot.pixels().map(|pixel| [pixel[0], pixel[1], pixel[2]]).eq(session.seen(size))
            });
        }
    }
    session.close();
}

/// A swapchain is made of a size that its window had when it was asked: told where the window has changed since.
const SIZE_HAS_CHANGED: &str = "VUID-VkSwapchainCreateInfoKHR-pNext-07781";

/// At any time, swapchains being made or not. The layer is told to skip the one message that this can cause and that no application can prevent.
#[test]
fn two_hundred_sizes_in_a_hurry_are_followed_in_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let program = env!("CARGO_BIN_EXE_hello_triangle");
    let variables = [("VK_LAYER_MESSAGE_ID_FILTER", SIZE_HAS_CHANGED)];
    let Some(mut session) = Session::with_variables(program, &[], folder.path(), &variables) else { return };
    let shot = folder.path().join("hello_triangle_window_0001.png");
    session.press(SPACE);
    session.press(F1);
    for (pause, size) in (0..16).cycle().zip(sizes(200)) {
        session.resize(size);
        thread::sleep(Duration::from_millis(pause));
    }
    let last = [311, 207];
    session.resize(last);
    session.shoot_until(&shot, |_, shot| shot.dimensions() == last.into());
    session.close();
}

/// The formats that the device has, as the sample says them.
fn yuv_formats(program: &str, folder: &Path) -> Vec<String> {
    let output = sample(program, &["--frames", "1"], folder).output().unwrap();
    assert_success(&output);
    let (said, _) = texts(&output);
    let (_, list) = said.split_once("the device has [").unwrap();
    list.split_once(']').unwrap().0.split(", ").map(str::to_owned).collect()
}

/// Formats of 8 bits give one picture, those of 10 bits another, which is rounded otherwise: the key goes through all, and back
/// to the first.
#[test]
fn a_key_goes_through_the_formats() {
    let folder = tempfile::tempdir().unwrap();
    let program = env!("CARGO_BIN_EXE_yuv");
    let formats = yuv_formats(program, folder.path());
    let Some(mut session) = Session::new(program, &["--model", "bt601"], folder.path()) else { return };
    let mut shots = 0;
    let mut take_screenshot = |session: &mut Session| {
        shots += 1;
        session.take_screenshot(&folder.path().join(format!("yuv_window_{shots:04}.png")))
    };
    session.press(SPACE);
    session.press(F1);
    take_screenshot(&mut session);
    let first = take_screenshot(&mut session);
    assert!(take_screenshot(&mut session) == first, "the picture stands still");
    let bits = |format: &String| if format.ends_with("10") { 10 } else { 8 };
    for format in formats.iter().cycle().skip(1).take(formats.len()) {
        session.press(KEY_N);
        thread::sleep(Duration::from_millis(300));
        let next = take_screenshot(&mut session);
        assert_eq!(next == first, bits(format) == bits(&formats[0]), "{format} of {formats:?}");
        let others = differing_by(8, &first, &next, 0);
        assert!(others < 0.01, "{format} shows something else in {others} of the picture");
    }
    session.close();
}

#[test]
fn shaders_are_compiled_as_they_change_and_wrong_ones_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let shaders = folder.path().join("shaders");
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shaders");
    for part in ["app", "rtx_hello", "common"] {
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
