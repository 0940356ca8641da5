//! Programs in windows of a virtual X server: how they start, get input and end, and the comparison of their images.

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

pub(crate) const SIZE: [u32; 2] = [416, 224];
/// An x coordinate to the right of the panel.
pub(crate) const BESIDE_PANEL: u32 = 352;
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// Key codes of X servers.
pub(crate) const ESCAPE: u8 = 9;
pub(crate) const KEY_W: u8 = 25;
pub(crate) const KEY_N: u8 = 57;
pub(crate) const SPACE: u8 = 65;
pub(crate) const F1: u8 = 67;
pub(crate) const F9: u8 = 75;
pub(crate) const F12: u8 = 96;

/// The X server of a test; `None`, loudly, where there is none and none can be fetched.
pub(crate) fn desktop() -> Option<VirtualDisplay> {
    match virtual_display() {
        Ok(display) => Some(display),
        Err(error) => {
            assert!(std::env::var_os("LVK_REQUIRE_GPU").is_none(), "{error}");
            eprintln!("SKIPPED, no X server for windows: {error}");
            None
        }
    }
}

pub(crate) fn sample(program: &str, args: &[&str], folder: &Path) -> Command {
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

pub(crate) fn texts(output: &Output) -> (String, String) {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (text(&output.stdout), text(&output.stderr))
}

pub(crate) fn assert_success(output: &Output) {
    let (out, err) = texts(output);
    assert_eq!(output.status.code(), Some(0), "{out}{err}");
}

pub(crate) fn read_image(path: &Path) -> RgbaImage {
    image::open(path).unwrap().into_rgba8()
}

/// Share of the pixels right of `first` in which two pictures differ by more than rounding.
pub(crate) fn differing(one: &RgbaImage, other: &RgbaImage, first: u32) -> f64 {
    differing_by(1, one, other, first)
}

/// The same by more than so many steps of a channel.
pub(crate) fn differing_by(steps: u8, one: &RgbaImage, other: &RgbaImage, first: u32) -> f64 {
    assert_eq!(one.dimensions(), other.dimensions());
    let pairs: Vec<_> =
        one.enumerate_pixels().zip(other.pixels()).filter(|((x, ..), _)| *x >= first).collect();
    let differs = |((.., a), b): &&((u32, u32, &image::Rgba<u8>), &image::Rgba<u8>)| {
        a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > steps)
    };
    pairs.iter().filter(differs).count() as f64 / pairs.len() as f64
}

/// A sample in its own window, with simulated key presses, and its standard error.
pub(crate) struct Session {
    program: Child,
    pub(crate) said: Receiver<String>,
    pub(crate) keys: RustConnection,
    pub(crate) root: u32,
    pub(crate) window: u32,
    _desktop: VirtualDisplay,
}

impl Session {
    pub(crate) fn new(program: &str, args: &[&str], folder: &Path) -> Option<Self> {
        Self::with_variables(program, args, folder, &[])
    }

    pub(crate) fn with_variables(
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
    pub(crate) fn focus(&mut self) {
        self.window = self.find_window().unwrap();
        let time = x11rb::CURRENT_TIME;
        self.keys.set_input_focus(InputFocus::PARENT, self.window, time).unwrap().check().unwrap();
    }

    /// Makes the program close its window, and waits for the next one.
    pub(crate) fn reopen(&mut self) {
        let before = self.window;
        self.press(F9);
        self.wait("another window", |session| session.find_window().is_some_and(|window| window != before));
        self.focus();
    }

    /// The visible window of some size.
    pub(crate) fn find_window(&self) -> Option<u32> {
        let children = self.keys.query_tree(self.root).unwrap().reply().unwrap().children;
        children.into_iter().find(|window| {
            let size = self.keys.get_geometry(*window).unwrap().reply();
            let is_seen = self.keys.get_window_attributes(*window).unwrap().reply();
            size.is_ok_and(|size| size.width > 100)
                && is_seen.is_ok_and(|seen| seen.map_state == x11rb::protocol::xproto::MapState::VIEWABLE)
        })
    }

    pub(crate) fn wait(&mut self, what: &str, is_done: impl Fn(&mut Self) -> bool) {
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
    pub(crate) fn wait_for_line(&mut self, part: &str) {
        self.wait(part, |session| session.said.try_iter().any(|line| line.contains(part)));
    }

    pub(crate) fn key(&self, key: u8, is_down: bool) {
        let event = if is_down { KEY_PRESS_EVENT } else { KEY_RELEASE_EVENT };
        self.keys
            .xtest_fake_input(event, key, x11rb::CURRENT_TIME, self.root, 0, 0, 0)
            .unwrap()
            .check()
            .unwrap();
    }

    pub(crate) fn press(&self, key: u8) {
        self.key(key, true);
        thread::sleep(Duration::from_millis(50));
        self.key(key, false);
    }

    /// Presses the key for screenshots, and answers the picture.
    pub(crate) fn take_screenshot(&mut self, path: &Path) -> RgbaImage {
        self.press(F12);
        self.wait("a screenshot", |_| path.exists());
        read_image(path)
    }

    pub(crate) fn resize(&self, [width, height]: [u32; 2]) {
        let size = ConfigureWindowAux::new().width(width).height(height);
        self.keys.configure_window(self.window, &size).unwrap().check().unwrap();
    }

    /// Takes screenshots, each written to `path` and taken away, until one is as it should be.
    pub(crate) fn shoot_until(&mut self, path: &Path, is_right: impl Fn(&Self, &RgbaImage) -> bool) {
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

    /// The window's pixels on the server, without alpha.
    pub(crate) fn seen(&self, [width, height]: [u32; 2]) -> Vec<[u8; 3]> {
        let [width, height] = [width as u16, height as u16];
        let asked = self.keys.get_image(ImageFormat::Z_PIXMAP, self.window, 0, 0, width, height, !0);
        let data = asked.unwrap().reply().unwrap().data;
        data.chunks_exact(4).map(|pixel| [pixel[2], pixel[1], pixel[0]]).collect()
    }

    /// Closes the window by its key. Returns the lines printed since the last call that waited for one.
    pub(crate) fn close(mut self) -> Vec<String> {
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
