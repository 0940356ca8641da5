//! The examples of `lvk` are short, and show or print what their first lines say, under a silent validation layer.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, Stdio};

use lvk_tests::device::vulkan;
use tempfile::TempDir;

/// Longest example, in lines with its shaders.
const MAX_LINES: usize = 120;
/// Width and height of the images that examples write.
const SIZE: usize = 512;
/// Bytes of a pixel of a PPM image.
const PIXEL: usize = 3;

/// An example that runs in a folder of its own, under core and synchronization validation.
struct Example {
    command: Command,
    folder: TempDir,
}

impl Example {
    /// `None` as for [`vulkan`]. The example opens the loader that the dynamic linker finds.
    fn new(name: &str) -> Option<Self> {
        let library = vulkan()?;
        let folder = tempfile::tempdir().unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_run_example"));
        command.arg(name).current_dir(folder.path()).stdin(Stdio::null());
        command
            .env("VK_INSTANCE_LAYERS", "VK_LAYER_KHRONOS_validation")
            .env("VK_LAYER_VALIDATE_SYNC", "1")
            .env("VK_LAYER_REPORT_FLAGS", "error,warn")
            .env("VK_LAYER_DEBUG_ACTION", "VK_DBG_LAYER_ACTION_LOG_MSG")
            .env("VK_LAYER_LOG_FILENAME", folder.path().join("validation.txt"));
        let mut example = Self { command, folder };
        if let Some(libraries) = library.and_then(Path::parent) {
            example.add_library_folder(libraries);
        }
        Some(example)
    }

    /// Puts a folder in front of those in which the dynamic linker looks for libraries.
    fn add_library_folder(&mut self, folder: &Path) {
        let set = self.command.get_envs().find(|(name, _)| *name == "LD_LIBRARY_PATH");
        let before = set.and_then(|(_, value)| value.map(OsString::from));
        let mut folders = folder.as_os_str().to_owned();
        if let Some(before) = before.or_else(|| std::env::var_os("LD_LIBRARY_PATH")) {
            folders.push(":");
            folders.push(before);
        }
        self.command.env("LD_LIBRARY_PATH", folders);
    }

    /// Runs the example to its end and returns its output, without the line by which the layer names its log.
    fn output(&mut self) -> String {
        let output = self.command.output().unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let (out, err) = (text(&output.stdout), text(&output.stderr));
        assert!(output.status.success(), "{out}{err}");
        self.assert_valid();
        let lines = out.lines().filter(|line| !line.starts_with("Validation Layer Info"));
        lines.map(|line| format!("{line}\n")).collect()
    }

    /// The layer creates its log when it is loaded.
    fn assert_valid(&self) {
        let messages = std::fs::read_to_string(self.folder.path().join("validation.txt")).unwrap();
        assert!(messages.is_empty(), "the validation layer is not silent:\n{messages}");
    }

    /// Runs the example and returns the image that it writes.
    fn image(&mut self, name: &str) -> Image {
        self.output();
        let bytes = std::fs::read(self.folder.path().join(name)).unwrap();
        let pixels = bytes.strip_prefix(b"P6 512 512 255\n").unwrap().to_vec();
        assert_eq!(pixels.len(), SIZE * SIZE * PIXEL);
        Image { pixels }
    }
}

/// An image of [`SIZE`] pixels a side.
struct Image {
    pixels: Vec<u8>,
}

impl Image {
    fn at(&self, [x, y]: [usize; 2]) -> [u8; PIXEL] {
        let first = (y * SIZE + x) * PIXEL;
        [self.pixels[first], self.pixels[first + 1], self.pixels[first + 2]]
    }

    /// Asserts the color of pixels; rounding may differ by one.
    fn assert_color(&self, color: [f32; PIXEL], places: &[[usize; 2]]) {
        for &place in places {
            let (is, should) = (self.at(place).map(f32::from), color.map(|channel| channel * 255.0));
            let is_close = is.iter().zip(should).all(|(is, should)| (is - should).abs() <= 1.0);
            assert!(is_close, "{is:?} at {place:?}, not {should:?}");
        }
    }
}

fn sources() -> Vec<(String, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../lvk/examples");
    let mut sources: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .map(|path| {
            (path.file_stem().unwrap().to_str().unwrap().to_owned(), std::fs::read_to_string(path).unwrap())
        })
        .collect();
    sources.sort();
    sources
}

#[test]
fn examples_are_short_and_the_readme_of_the_library_lists_them() {
    let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("../lvk/README.md");
    let readme = std::fs::read_to_string(readme).unwrap();
    let runner = include_str!("../../src/bin/run_example.rs");
    for (name, source) in sources() {
        let lines = source.lines().count();
        assert!(lines <= MAX_LINES, "{name}: {lines} lines");
        assert!(source.starts_with("//! "), "{name}: the first line says what the example does");
        assert!(readme.contains(&format!("| `{name}` |")), "{name} is not in lvk/README.md");
        assert!(runner.contains(&format!("{name}::main()")), "{name} is not in run_example.rs");
    }
}

#[test]
fn compute_prints_the_sum_of_squares() {
    let Some(mut example) = Example::new("compute") else { return };
    assert_eq!(example.output(), "357389824\n");
}

#[test]
fn guest_prints_what_the_engine_reads() {
    let Some(mut example) = Example::new("guest") else { return };
    assert_eq!(example.output(), "[0, 7, 14, 21, 28, 35, 42, 49]\n");
}

#[test]
fn draw_shows_the_nearer_triangle_of_two_that_cross() {
    let Some(mut example) = Example::new("draw") else { return };
    let image = example.image("draw.ppm");
    image.assert_color([1.0, 0.2, 0.1], &[[153, 256], [80, 256], [60, 140]]);
    image.assert_color([0.1, 0.9, 0.3], &[[358, 256], [431, 256], [451, 371]]);
    image.assert_color([0.0; 3], &[[5, 5], [256, 130], [256, 382], [500, 256]]);
}

#[test]
fn ray_query_fragment_shows_a_shadow_beside_its_triangle() {
    let Some(mut example) = Example::new("ray_query_fragment") else { return };
    let image = example.image("shadow.ppm");
    image.assert_color([1.0, 0.5, 0.0], &[[333, 289], [330, 220], [333, 440]]);
    image.assert_color([0.2; 3], &[[256, 166], [160, 150], [270, 370]]);
    image.assert_color([0.8; 3], &[[51, 460], [460, 460], [460, 160], [130, 130]]);
}

#[test]
fn ray_pipeline_shows_a_record_for_each_triangle() {
    let Some(mut example) = Example::new("ray_pipeline") else { return };
    let image = example.image("records.ppm");
    image.assert_color([1.0, 0.2, 0.2], &[[128, 333], [100, 340]]);
    image.assert_color([0.5, 0.1, 0.1], &[[128, 205]]);
    image.assert_color([0.2, 0.6, 1.0], &[[384, 352], [350, 352]]);
    image.assert_color([0.1, 0.3, 0.5], &[[384, 339], [350, 339]]);
    image.assert_color([0.1, 0.1, 0.2], &[[5, 5], [256, 256], [500, 500]]);
}

#[cfg(target_os = "linux")]
mod window {
    use std::time::{Duration, Instant};

    use x11rb::connection::Connection;
    use x11rb::protocol::xproto::{
        AtomEnum, ClientMessageEvent, ConnectionExt, EventMask, ImageFormat, Window,
    };
    use x11rb::rust_connection::RustConnection;

    use super::*;

    /// Longest time until the window shows something.
    const TIMEOUT: Duration = Duration::from_secs(60);

    /// Returns the visible window of this title, if it is there.
    fn find_window(x: &RustConnection, title: &str) -> Option<Window> {
        let root = x.setup().roots[0].root;
        let windows = x.query_tree(root).unwrap().reply().unwrap().children;
        windows.into_iter().find(|&window| {
            let name = x.get_property(false, window, AtomEnum::WM_NAME, AtomEnum::ANY, 0, 64).unwrap();
            name.reply().is_ok_and(|name| name.value == title.as_bytes())
        })
    }

    /// Red, green and blue of the pixel at a fraction of the window's size; `None` while nothing can be read.
    fn color_at(x: &RustConnection, window: Window, [across, down]: [f32; 2]) -> Option<[u8; PIXEL]> {
        let size = x.get_geometry(window).ok()?.reply().ok()?;
        let place = [(f32::from(size.width) * across) as i16, (f32::from(size.height) * down) as i16];
        let image = x.get_image(ImageFormat::Z_PIXMAP, window, place[0], place[1], 1, 1, u32::MAX).ok()?;
        let data = image.reply().ok()?.data;
        Some([data[2], data[1], data[0]])
    }

    /// Asks the program to close its window, as the button of the title bar does.
    fn close(x: &RustConnection, window: Window) {
        let atom = |name: &[u8]| x.intern_atom(false, name).unwrap().reply().unwrap().atom;
        let delete = [atom(b"WM_DELETE_WINDOW"), 0, 0, 0, 0];
        let event = ClientMessageEvent::new(32, window, atom(b"WM_PROTOCOLS"), delete);
        x.send_event(false, window, EventMask::NO_EVENT, event).unwrap();
        x.flush().unwrap();
    }

    #[test]
    fn window_shows_a_triangle_until_it_is_closed() {
        let Some(mut example) = Example::new("window") else { return };
        let Some(display) = lvk_tests::windows::display() else { return };
        let libraries = example.command.get_envs().find(|(name, _)| *name == "LD_LIBRARY_PATH");
        let libraries = libraries.and_then(|(_, value)| value.map(OsString::from));
        display.attach(&mut example.command);
        if let Some(libraries) = libraries {
            example.add_library_folder(Path::new(&libraries));
        }
        let (x, _) = RustConnection::connect(Some(display.name())).unwrap();
        let mut program = example.command.spawn().unwrap();
        let start = Instant::now();
        let shown = loop {
            assert!(program.try_wait().unwrap().is_none(), "the example ended by itself");
            assert!(start.elapsed() < TIMEOUT, "the window shows no triangle");
            let window = find_window(&x, "lvk");
            // The corners are red, green and blue; the middle has a share of each.
            if let Some(window) = window
                && let Some(middle) = color_at(&x, window, [0.5, 0.6])
                && middle.iter().all(|channel| *channel > 60)
            {
                break window;
            }
            std::thread::sleep(Duration::from_millis(20));
        };
        assert_eq!(color_at(&x, shown, [0.05, 0.05]), Some([0; 3]));
        let left = color_at(&x, shown, [0.2, 0.83]).unwrap();
        assert!(left[0] > left[1] && left[0] > left[2], "{left:?}");
        close(&x, shown);
        assert!(program.wait().unwrap().success());
        example.assert_valid();
    }
}
