//! The samples' windows as a user meets them, on an X server without a screen.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod missing_features;

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use image::RgbaImage;
use lvk_dev_driver::{VirtualDisplay, virtual_display};
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{
    ConfigureWindowAux, ConnectionExt as _, ImageFormat, InputFocus, KEY_PRESS_EVENT, KEY_RELEASE_EVENT,
};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;

const SIZE: [u32; 2] = [416, 224];
/// An x coordinate to the right of the panel.
const BESIDE_PANEL: u32 = 352;
const PATIENCE: Duration = Duration::from_secs(60);

/// Key codes of X servers.
const ESCAPE: u8 = 9;
const KEY_W: u8 = 25;
const KEY_N: u8 = 57;
const SPACE: u8 = 65;
const F1: u8 = 67;
const F9: u8 = 75;
const F12: u8 = 96;

/// The X server of a test; `None`, loudly, where there is none and none can be fetched.
fn desktop() -> Option<VirtualDisplay> {
    match virtual_display() {
        Ok(display) => Some(display),
        Err(error) => {
            assert!(std::env::var_os("LVK_REQUIRE_GPU").is_none(), "{error}");
            eprintln!("SKIPPED, no X server for windows: {error}");
            None
        }
    }
}

fn sample(program: &str, args: &[&str], folder: &Path) -> Command {
    let mut command = Command::new(program);
    command.args(args).current_dir(folder);
    command.args(["--width", &SIZE[0].to_string(), "--height", &SIZE[1].to_string()]);
    command
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .env_remove("DISPLAY")
        .env("LVK_CACHE", "")
        .stdin(Stdio::null());
    command
}

fn texts(output: &Output) -> (String, String) {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (text(&output.stdout), text(&output.stderr))
}

fn assert_success(output: &Output) {
    let (out, err) = texts(output);
    assert_eq!(output.status.code(), Some(0), "{out}{err}");
}

fn read_image(path: &Path) -> RgbaImage {
    image::open(path).unwrap().into_rgba8()
}

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

#[test]
fn deferred_has_a_window() {
    prints_what_it_writes(env!("CARGO_BIN_EXE_deferred"), &["--lights", "60"]);
}

#[test]
fn hello_triangle_has_a_window() {
    prints_what_it_writes(env!("CARGO_BIN_EXE_hello_triangle"), &[]);
}

#[test]
fn render_to_cube_map_has_a_window() {
    prints_what_it_writes(env!("CARGO_BIN_EXE_render_to_cube_map"), &["--face-size", "64"]);
}

#[test]
fn omni_shadows_has_a_window() {
    prints_what_it_writes(env!("CARGO_BIN_EXE_omni_shadows"), &["--show-cube"]);
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
fn yuv_has_a_window() {
    prints_what_it_writes(env!("CARGO_BIN_EXE_yuv"), &[]);
}

#[test]
fn triplanar_has_a_window() {
    prints_what_it_writes(env!("CARGO_BIN_EXE_triplanar"), &[]);
}

#[test]
fn rtx_hello_has_a_window() {
    prints_what_it_writes(env!("CARGO_BIN_EXE_rtx_hello"), &[]);
}

#[test]
fn rtx_textures_has_a_window() {
    prints_what_it_writes(env!("CARGO_BIN_EXE_rtx_textures"), &[]);
}

#[test]
fn rtx_pipeline_has_a_window() {
    prints_what_it_writes(env!("CARGO_BIN_EXE_rtx_pipeline"), &[]);
}

#[test]
fn rtx_ao_has_a_window() {
    prints_what_it_writes(env!("CARGO_BIN_EXE_rtx_ao"), &["--passes", "1"]);
}

#[test]
fn sponza_has_a_window() {
    prints_what_it_writes(env!("CARGO_BIN_EXE_sponza"), &["--shadow-size", "512"]);
}

#[test]
fn large_scene_has_a_window() {
    let args = ["--triangles", "20000", "--copies", "30", "--samples", "1"];
    prints_what_it_writes(env!("CARGO_BIN_EXE_large_scene"), &args);
}

#[test]
fn hybrid_has_a_window() {
    prints_what_it_writes(env!("CARGO_BIN_EXE_hybrid"), &["--depth", "1"]);
}

#[test]
fn hybrid_oit_has_a_window() {
    prints_what_it_writes(env!("CARGO_BIN_EXE_hybrid_oit"), &["--supersampling", "1"]);
}

#[test]
fn reflections_has_a_window() {
    prints_what_it_writes(env!("CARGO_BIN_EXE_reflections"), &["--samples", "1"]);
}

/// A sample in its own window, with simulated key presses, and its standard error.
struct Session {
    program: Child,
    said: Receiver<String>,
    keys: RustConnection,
    root: u32,
    window: u32,
    _desktop: VirtualDisplay,
}

impl Session {
    fn new(program: &str, args: &[&str], folder: &Path) -> Option<Self> {
        Self::with_variables(program, args, folder, &[])
    }

    fn with_variables(
        program: &str,
        args: &[&str],
        folder: &Path,
        variables: &[(&str, &str)],
    ) -> Option<Self> {
        let desktop = desktop()?;
        let (keys, screen) = RustConnection::connect(Some(desktop.name())).unwrap();
        let root = keys.setup().roots[screen].root;
        let mut command = sample(program, &[&["--window", "--validate"], args].concat(), folder);
        desktop.attach(&mut command);
        command.envs(variables.iter().copied());
        let mut program = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let lines = BufReader::new(program.stderr.take().unwrap()).lines();
        let (say, said) = channel();
        thread::spawn(move || lines.map_while(Result::ok).all(|line| say.send(line).is_ok()));
        let mut session = Self { program, said, keys, root, window: 0, _desktop: desktop };
        session.wait("its window", |session| session.find_window().is_some());
        session.focus();
        Some(session)
    }

    /// Takes the window that is visible as the one that keys go to.
    fn focus(&mut self) {
        self.window = self.find_window().unwrap();
        let time = x11rb::CURRENT_TIME;
        self.keys.set_input_focus(InputFocus::PARENT, self.window, time).unwrap().check().unwrap();
    }

    /// Makes the program close its window, and waits for the next one.
    fn reopen(&mut self) {
        let before = self.window;
        self.press(F9);
        self.wait("another window", |session| session.find_window().is_some_and(|window| window != before));
        self.focus();
    }

    /// The visible window of some size.
    fn find_window(&self) -> Option<u32> {
        let children = self.keys.query_tree(self.root).unwrap().reply().unwrap().children;
        children.into_iter().find(|window| {
            let size = self.keys.get_geometry(*window).unwrap().reply();
            let is_seen = self.keys.get_window_attributes(*window).unwrap().reply();
            size.is_ok_and(|size| size.width > 100)
                && is_seen.is_ok_and(|seen| seen.map_state == x11rb::protocol::xproto::MapState::VIEWABLE)
        })
    }

    fn wait(&mut self, what: &str, is_done: impl Fn(&mut Self) -> bool) {
        let deadline = Instant::now() + PATIENCE;
        while !is_done(self) {
            let ended = self.program.try_wait().unwrap();
            let said = || self.said.try_iter().collect::<Vec<_>>();
            assert!(ended.is_none(), "{what}: the program has ended: {:?}", said());
            assert!(Instant::now() < deadline, "{what}: {:?}", said());
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Waits for a line on standard error.
    fn wait_for_line(&mut self, part: &str) {
        self.wait(part, |session| session.said.try_iter().any(|line| line.contains(part)));
    }

    fn key(&self, key: u8, is_down: bool) {
        let event = if is_down { KEY_PRESS_EVENT } else { KEY_RELEASE_EVENT };
        self.keys
            .xtest_fake_input(event, key, x11rb::CURRENT_TIME, self.root, 0, 0, 0)
            .unwrap()
            .check()
            .unwrap();
    }

    fn press(&self, key: u8) {
        self.key(key, true);
        thread::sleep(Duration::from_millis(50));
        self.key(key, false);
    }

    /// Presses the key for screenshots, and answers the picture.
    fn take_screenshot(&mut self, path: &Path) -> RgbaImage {
        self.press(F12);
        self.wait("a screenshot", |_| path.exists());
        read_image(path)
    }

    fn resize(&self, [width, height]: [u32; 2]) {
        let size = ConfigureWindowAux::new().width(width).height(height);
        self.keys.configure_window(self.window, &size).unwrap().check().unwrap();
    }

    /// The window's pixels on the server, without alpha.
    fn seen(&self, [width, height]: [u32; 2]) -> Vec<[u8; 3]> {
        let [width, height] = [width as u16, height as u16];
        let asked = self.keys.get_image(ImageFormat::Z_PIXMAP, self.window, 0, 0, width, height, !0);
        let data = asked.unwrap().reply().unwrap().data;
        data.chunks_exact(4).map(|pixel| [pixel[2], pixel[1], pixel[0]]).collect()
    }

    /// Closes the window by its key. Returns the lines printed since the last call that waited for one.
    fn close(mut self) -> Vec<String> {
        self.press(ESCAPE);
        let deadline = Instant::now() + PATIENCE;
        while self.program.try_wait().unwrap().is_none() {
            assert!(Instant::now() < deadline, "it does not close");
            thread::sleep(Duration::from_millis(20));
        }
        let mut out = String::new();
        std::io::Read::read_to_string(&mut self.program.stdout.take().unwrap(), &mut out).unwrap();
        // The program has ended, and so do its lines.
        let said: Vec<_> = self.said.iter().collect();
        assert!(out.contains("validation messages: 0"), "{out}{said:?}");
        assert_eq!(self.program.wait().unwrap().code(), Some(0), "{out}{said:?}");
        said
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
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

/// As on Android when an application is paused and comes back, by the same functions: on its device, with what was pressed
/// before, and without a message of the validation layer. A window that is destroyed from outside takes the same way, but
/// winit panics where it asks for such a window before it has read that it is gone.
#[test]
fn a_sample_goes_on_where_it_was_in_another_window() {
    let folder = tempfile::tempdir().unwrap();
    let program = env!("CARGO_BIN_EXE_rtx_textures");
    let Some(mut session) = Session::new(program, &[], folder.path()) else { return };
    let shot = |number: u32| folder.path().join(format!("rtx_textures_window_{number:04}.png"));
    session.press(SPACE);
    session.press(F1);
    let before = session.take_screenshot(&shot(1));
    for number in 2..12 {
        session.reopen();
        assert!(session.take_screenshot(&shot(number)) == before, "picture {number} is another one");
    }
    session.resize([300, 260]);
    thread::sleep(Duration::from_millis(600));
    assert_eq!(session.take_screenshot(&shot(12)).dimensions(), (300, 260));
    session.reopen();
    // The picture follows the size of the window a little later.
    thread::sleep(Duration::from_millis(600));
    assert!(session.take_screenshot(&shot(13)) == before, "a new window has the size of the first");
    session.press(SPACE);
    let animated = session.take_screenshot(&shot(14));
    assert!(differing(&before, &animated, 0) > 0.0, "the animation stands");
    let said = session.close();
    let is_wrong = |line: &&String| ["warning", "error", "alive"].iter().any(|word| line.contains(word));
    assert_eq!(said.iter().find(is_wrong), None);
}

#[test]
fn a_sample_goes_on_loading_in_another_window() {
    let folder = tempfile::tempdir().unwrap();
    let program = env!("CARGO_BIN_EXE_large_scene");
    let args = ["--triangles", "400000", "--samples", "1", "--depth", "0"];
    let Some(mut session) = Session::new(program, &args, folder.path()) else { return };
    let shot = |number: u32| folder.path().join(format!("large_scene_window_{number:04}.png"));
    session.wait_for_line("making the valley");
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

impl Session {
    /// Takes screenshots, each written to `path` and taken away, until one is as it should be.
    fn shoot_until(&mut self, path: &Path, is_right: impl Fn(&Self, &RgbaImage) -> bool) {
        for _ in 0..50 {
            self.key(F12, true);
            self.key(F12, false);
            self.wait("a screenshot", |_| path.exists());
            let shot = read_image(path);
            fs::remove_file(path).unwrap();
            if is_right(self, &shot) {
                return;
            }
        }
        unreachable!("no picture of the window is right");
    }
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
