//! The `hybrid` program as a user meets it: what it prints, what it writes and its exit status.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Once;
use std::time::{Duration, Instant};

use lvk_dev_driver::{DriverRequest, prepare, swiftshader_icd};
use tempfile::TempDir;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
const WIDTH: u32 = 64;
const HEIGHT: u32 = 36;

/// A folder of input files and an empty one for output.
struct Desk {
    input: TempDir,
    output: TempDir,
}

/// The result of a run of the program.
struct Outcome {
    status: Option<i32>,
    out: String,
    err: String,
}

impl Desk {
    fn new() -> Self {
        Self { input: tempfile::tempdir().unwrap(), output: tempfile::tempdir().unwrap() }
    }

    /// Writes an input file and returns its path.
    fn file(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        let path = self.input.path().join(name);
        fs::write(&path, content).unwrap();
        path.display().to_string()
    }

    fn output_path(&self) -> PathBuf {
        self.output.path().join("picture.png")
    }

    /// The program with a small picture as its output.
    fn command(&self, args: &[&str]) -> Command {
        let mut command = hybrid(args);
        command.arg("--out").arg(self.output_path());
        command.args(["--width", &WIDTH.to_string(), "--height", &HEIGHT.to_string()]);
        command
    }

    /// The same on a device without ray tracing; `None`, loudly, where that cannot be had.
    fn without_ray_tracing(&self, args: &[&str]) -> Option<Command> {
        let icd = match swiftshader_icd() {
            Ok(icd) => icd,
            Err(error) => {
                assert!(std::env::var_os("LVK_REQUIRE_GPU").is_none(), "{error}");
                eprintln!("SKIPPED, no device without ray tracing: {error}");
                return None;
            }
        };
        let mut command = self.command(args);
        command.env("VK_DRIVER_FILES", icd).env_remove("VK_ICD_FILENAMES").env_remove("LVK_DRIVER");
        Some(command)
    }

    fn run(&self, args: &[&str]) -> Outcome {
        Outcome::from_command(self.command(args))
    }

    fn output_files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.output.path()).unwrap();
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    }

    /// The size of the picture, which is the only file that was written.
    fn image_size(&self) -> (u32, u32) {
        assert_eq!(self.output_files(), ["picture.png"]);
        image::open(self.output_path()).unwrap().into_rgba8().dimensions()
    }
}

impl Outcome {
    fn from_command(mut command: Command) -> Self {
        let Output { status, stdout, stderr } = command.output().unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        Self { status: status.code(), out: text(stdout), err: without_driver_note(&text(stderr)) }
    }

    /// Fails unless the program ended with `status` and one line of error, which names all of `parts`.
    fn assert_error(&self, status: i32, parts: &[&str]) {
        let Self { out, err, .. } = self;
        assert_eq!(self.status, Some(status), "{parts:?}: {out}{err}");
        assert!(err.starts_with("error: ") && err.ends_with('\n') && err.lines().count() == 1, "{err}");
        assert_names(err, parts);
        assert!(err.len() > "error: ".len() + 20, "{err}");
    }

    /// As [`assert_error`](Self::assert_error), for mistakes in the command line itself, whose message goes on with a
    /// hint.
    fn assert_usage_error(&self, parts: &[&str]) {
        assert_eq!(self.status, Some(2), "{}", self.err);
        let first = self.err.lines().next().unwrap_or_default();
        assert!(first.starts_with("error: "), "{}", self.err);
        assert_names(&self.err, parts);
    }

    fn assert_success(&self) {
        assert_eq!(self.status, Some(0), "{}{}", self.out, self.err);
    }
}

/// Leaves out the line that gives the reason for the software driver, on machines that need it.
fn without_driver_note(err: &str) -> String {
    err.split_inclusive('\n')
        .filter(|line| !line.starts_with("lvk: a software driver is used, because "))
        .collect()
}

fn assert_names(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "no `{part}` in: {text}");
    }
}

/// The program; on a machine without a driver it has fetched what it needs already, and said so.
fn hybrid(args: &[&str]) -> Command {
    static FETCHED: Once = Once::new();
    FETCHED.call_once(|| {
        let desk = Desk::new();
        let scene = desk.file("triangle.obj", TRIANGLE);
        let mut command = Command::new(env!("CARGO_BIN_EXE_hybrid"));
        command.args(["--scene", &scene, "--validate", "--width", "8", "--height", "8", "--out"]);
        command.arg(desk.output_path()).output().unwrap();
    });
    let mut command = Command::new(env!("CARGO_BIN_EXE_hybrid"));
    command.args(args).env_remove("LVK_DEVICE").env("LVK_CACHE", "");
    command
}

/// True if a device was found. Returns false and prints a line without a device, if `LVK_SKIP_GPU_TESTS` allows that.
fn has_device() -> bool {
    let is_set = |name| std::env::var(name).is_ok_and(|value| !value.is_empty() && value != "0");
    if !is_set("LVK_SKIP_GPU_TESTS") || is_set("LVK_REQUIRE_GPU") {
        return true;
    }
    let found = prepare(&DriverRequest { validation: true });
    if let Err(error) = &found {
        eprintln!("SKIPPED, no Vulkan device: {error}");
    }
    found.is_ok()
}

/// A desk with a scene, where a device can render it.
fn desk_with_device() -> Option<(Desk, String)> {
    has_device().then(|| {
        let desk = Desk::new();
        let scene = desk.file("triangle.obj", TRIANGLE);
        (desk, scene)
    })
}

#[test]
fn a_scene_that_cannot_be_loaded_is_named_and_leaves_nothing() {
    let desk = Desk::new();
    let absent = desk.input.path().join("absent.obj").display().to_string();
    let folder = desk.input.path().display().to_string();
    for (path, parts) in [
        (absent, ["absent.obj", "no such file"]),
        (folder, ["cannot read", "directory"]),
        (desk.file("letter.obj", "Dear Sir or Madam,\n"), ["letter.obj", "not a Wavefront OBJ"]),
        (desk.file("binary.obj", [0x89, b'P', 0, 1, 2, 3, 255, 254]), ["binary.obj", "not a Wavefront OBJ"]),
        (desk.file("nothing.obj", ""), ["nothing.obj", "not a Wavefront OBJ"]),
        (desk.file("points.obj", "v 0 0 0\nv 1 0 0\n"), ["points.obj", "nothing to draw"]),
        (desk.file("line.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"), ["line.obj", "nothing to draw"]),
        (desk.file("nan.obj", format!("{TRIANGLE}v 0 nan 0\n")), ["nan.obj:5", "not finite"]),
        (desk.file("word.obj", format!("{TRIANGLE}v 0 zero 0\n")), ["word.obj:5", "zero"]),
        (desk.file("range.obj", format!("{TRIANGLE}f 1 2 4\n")), ["range.obj:5", "vertex 4"]),
        (desk.file("back.obj", format!("{TRIANGLE}f -1 -2 -4\n")), ["back.obj:5", "vertex -4"]),
    ] {
        desk.run(&["--scene", &path]).assert_error(2, &parts);
    }
    assert_eq!(desk.output_files(), Vec::<String>::new());
}

#[test]
fn a_bad_camera_file_is_named_and_leaves_nothing() {
    let desk = Desk::new();
    let scene = desk.file("triangle.obj", TRIANGLE);
    let absent = desk.input.path().join("absent.txt").display().to_string();
    for (path, parts) in [
        (absent, ["absent.txt", "no such file"]),
        (desk.file("short.txt", "scene a 0 1 2\nat 1 2 3\n"), ["short.txt:2", "expected"]),
        (desk.file("empty.txt", ""), ["empty.txt", "expected"]),
        (desk.file("word.txt", "scene a 0 1 two\n"), ["word.txt:1", "expected"]),
    ] {
        desk.run(&["--scene", &scene, "--cameras", &path]).assert_error(2, &parts);
    }
    assert_eq!(desk.output_files(), Vec::<String>::new());
}

#[test]
fn an_image_that_cannot_be_written_is_refused_before_any_work() {
    let desk = Desk::new();
    let absent = desk.input.path().join("absent.obj");
    for place in [desk.output.path().join("no/such/folder.png"), desk.output.path().to_path_buf()] {
        let mut command = hybrid(&["--scene", &absent.display().to_string()]);
        command.arg("--out").arg(&place);
        Outcome::from_command(command).assert_error(2, &[&place.display().to_string()]);
    }
    assert_eq!(desk.output_files(), Vec::<String>::new());
}

#[test]
fn an_image_never_replaces_what_is_read() {
    let desk = Desk::new();
    let scene = desk.file("scene.png", TRIANGLE);
    let cameras = desk.file("cameras.png", "scene a 0 1 2\n");
    let detour = |name: &str| desk.input.path().join(".").join(name).display().to_string();
    for (out, option) in [(&scene, "--scene"), (&detour("scene.png"), "--scene"), (&cameras, "--cameras")] {
        let outcome =
            Outcome::from_command(hybrid(&["--scene", &scene, "--cameras", &cameras, "--out", out]));
        outcome.assert_error(2, &["--out", option, "same file"]);
    }
    assert_eq!(fs::read_to_string(scene).unwrap(), TRIANGLE);
    assert_eq!(fs::read_to_string(cameras).unwrap(), "scene a 0 1 2\n");
}

#[test]
fn caches_are_kept_dropped_when_damaged_and_never_needed() {
    if !has_device() {
        return;
    }
    let desk = Desk::new();
    let (scene, cache) = (desk.file("triangle.obj", TRIANGLE), desk.input.path().join("kept"));
    let run = |cache: &Path, more: &[&str]| {
        let mut command = desk.command(&[&["--scene", scene.as_str(), "--rt", "software"], more].concat());
        command.env("LVK_CACHE", cache);
        let outcome = Outcome::from_command(command);
        outcome.assert_success();
        (fs::read(desk.output_path()).unwrap(), outcome.err)
    };
    let (picture, _) = run(&cache, &["--no-cache"]);
    assert!(!cache.exists(), "nothing is kept unasked");
    let files = |name: &str| fs::read_dir(cache.join(name)).map_or(0, Iterator::count);
    assert_eq!(run(&cache, &[]).0, picture);
    assert!(cache.join("hybrid.pipelines").is_file() && files("shaders") > 0 && files("trees") > 0);
    let (warm, said) = run(&cache, &[]);
    assert_eq!((warm, said.contains("warning")), (picture.clone(), false), "{said}");
    fs::write(cache.join("hybrid.pipelines"), "nonsense").unwrap();
    let (mended, said) = run(&cache, &[]);
    assert_eq!(mended, picture);
    assert_names(&said, &["warning: the pipeline cache", "hybrid.pipelines", "dropped"]);
    let (without, said) = run(&Path::new(&scene).join("below a file"), &[]);
    assert_eq!(without, picture);
    assert_names(&said, &["warning: nothing is kept for the next start", "below a file"]);
}

#[test]
fn an_image_that_is_not_named_as_a_png_is_refused() {
    let desk = Desk::new();
    for name in ["picture.jpg", "picture", "png"] {
        let out = desk.output.path().join(name).display().to_string();
        Outcome::from_command(hybrid(&["--out", &out]))
            .assert_error(2, &[name, "the picture is a PNG", ".png"]);
    }
    // These names pass, so the scene is what is wrong.
    let scene = desk.file("nothing.obj", "");
    for out in [desk.output.path().join("PICTURE.PNG").display().to_string(), "/dev/null".to_owned()] {
        Outcome::from_command(hybrid(&["--scene", &scene, "--out", &out])).assert_error(2, &["nothing.obj"]);
    }
    assert_eq!(desk.output_files(), Vec::<String>::new());
}

#[test]
fn a_driver_wish_that_is_not_understood_is_wrong_input() {
    let desk = Desk::new();
    let mut command = desk.command(&["--scene", &desk.file("triangle.obj", TRIANGLE)]);
    command.env("LVK_DRIVER", "fast");
    Outcome::from_command(command).assert_error(2, &["LVK_DRIVER=fast", "`system` or `software`"]);
    assert_eq!(desk.output_files(), Vec::<String>::new());
}

#[test]
fn an_earlier_image_survives_an_error() {
    let desk = Desk::new();
    fs::write(desk.output_path(), "earlier").unwrap();
    desk.run(&["--scene", &desk.file("nothing.obj", "")]).assert_error(2, &["nothing.obj"]);
    assert_eq!(fs::read(desk.output_path()).unwrap(), b"earlier");
    assert_eq!(desk.output_files(), ["picture.png"]);
}

#[test]
fn wrong_arguments_are_named() {
    let folder = tempfile::tempdir().unwrap();
    for (line, parts) in [
        ("--width 0", ["--width", "1..=16384"]),
        ("--width 1000000", ["--width", "1..=16384"]),
        ("--height 0", ["--height", "1..=16384"]),
        ("--width -5", ["-5", "Usage"]),
        ("--depth 17", ["--depth", "0..=16"]),
        ("--camera 0", ["--camera", "1..=5"]),
        ("--camera 6", ["--camera", "1..=5"]),
        ("--frames 0", ["--frames", "'0'"]),
        ("--method raster", ["--method", "standalone, hybrid"]),
        ("--rt mesh", ["--rt", "auto, pipeline, query"]),
        ("--profile pixel", ["--profile", "mali-g715, mali-g720"]),
        ("--sceen a.obj", ["--sceen", "--scene"]),
        ("a.obj", ["a.obj", "Usage"]),
    ] {
        let mut command = hybrid(&line.split(' ').collect::<Vec<_>>());
        command.current_dir(folder.path());
        Outcome::from_command(command).assert_usage_error(&parts);
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn the_help_lists_every_option() {
    let help = Outcome::from_command(hybrid(&["--help"]));
    help.assert_success();
    assert_names(
        &help.out,
        &[
            "--scene",
            "--method",
            "--rt",
            "--width",
            "--height",
            "--frames",
            "--camera",
            "--depth",
            "--out",
            "--device",
            "--profile",
            "--validate",
            "--list-devices",
            "--cameras",
            "--scale",
            "Exit status",
        ],
    );
}

#[test]
fn every_method_writes_the_image_and_reports_its_times() {
    if !has_device() {
        return;
    }
    let files = Desk::new();
    let scene = files.file("triangle.obj", TRIANGLE);
    for (method, said) in [("standalone", "stand-alone"), ("hybrid", "hybrid:")] {
        for (rt, path) in [("pipeline", "ray tracing pipeline"), ("query", "ray queries")] {
            let desk = Desk::new();
            let args = ["--scene", &scene, "--method", method, "--rt", rt, "--frames", "2", "--validate"];
            let outcome = desk.run(&args);
            outcome.assert_success();
            assert_eq!(outcome.err, "", "{method} {rt}");
            assert_names(&outcome.out, &["device  ", said, path, "1 triangles", "validation messages: 0"]);
            assert_table(&outcome.out, method == "hybrid");
            assert_names(&outcome.out, &["wrote ", &desk.output_path().display().to_string()]);
            assert_eq!(desk.image_size(), (WIDTH, HEIGHT));
        }
    }
}

/// The table of GPU milliseconds: a head, then rows whose numbers grow from minimum to maximum.
fn assert_table(out: &str, has_geometry_pass: bool) {
    let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    let mut lines = out.lines().skip_while(|line| !line.starts_with("GPU ms"));
    assert_eq!(words(lines.next().unwrap()), ["GPU", "ms", "min", "median", "max"], "{out}");
    let rows: Vec<_> = lines.take_while(|line| !line.starts_with("wrote")).map(words).collect();
    assert_eq!(rows.len(), if has_geometry_pass { 3 } else { 2 }, "{out}");
    assert_eq!(rows.last().unwrap()[0], "total", "{out}");
    for row in rows {
        let numbers: Vec<f64> = row[row.len() - 3..].iter().map(|word| word.parse().unwrap()).collect();
        assert!(numbers.is_sorted() && numbers[2] > 0.0, "{out}");
    }
}

#[test]
fn missing_textures_and_materials_are_warnings_with_names() {
    if !has_device() {
        return;
    }
    let desk = Desk::new();
    desk.file("a.mtl", "newmtl wood\nKd 1 1 1\nmap_Kd absent.png\n");
    let text = format!("mtllib a.mtl\nusemtl wood\n{TRIANGLE}usemtl nowhere\nf 1 3 2\n");
    let outcome = desk.run(&["--scene", &desk.file("a.obj", text)]);
    outcome.assert_success();
    let warnings = outcome.err.lines().filter(|line| !line.starts_with("note: --rt auto takes "));
    assert_eq!(warnings.clone().count(), 2, "{}", outcome.err);
    assert!(warnings.clone().all(|line| line.starts_with("warning: ")), "{}", outcome.err);
    assert_names(&outcome.err, &["absent.png", "no such file", "`nowhere` is not defined"]);
    assert_eq!(desk.image_size(), (WIDTH, HEIGHT));
}

#[test]
fn devices_are_listed_a_line_each() {
    if !has_device() {
        return;
    }
    let outcome = Outcome::from_command(hybrid(&["--list-devices"]));
    outcome.assert_success();
    assert!(!outcome.out.is_empty());
    let devices = outcome.out.lines().take_while(|line| !line.starts_with("the system's own Vulkan"));
    for (number, line) in devices.enumerate() {
        assert!(line.starts_with(&format!("[{number}] ")), "{line}");
        assert_names(line, &["Vulkan 1.", "): ray tracing pipeline ", ", ray query "]);
    }
}

/// The program with a list of drivers, of which none can be used.
fn with_drivers(files: &Path, args: &[&str]) -> Command {
    let mut command = hybrid(args);
    command.env("VK_DRIVER_FILES", files).env_remove("VK_ICD_FILENAMES").env_remove("LVK_DRIVER");
    command
}

#[test]
fn a_machine_without_a_driver_that_works_lists_why() {
    if !has_device() {
        return;
    }
    let desk = Desk::new();
    let library =
        desk.file("libtoy.so", "a text in the place of a library, which is longer than the header of ELF");
    let broken = desk.file("toy.json", format!(r#"{{"file_format_version": "1.0.0", "ICD": {{"library_path": "{library}", "api_version": "1.3.0"}}}}"#));
    let absent = desk.input.path().join("absent.json");
    let scene = desk.file("triangle.obj", TRIANGLE);
    for (manifest, parts) in [
        (
            Path::new(&broken),
            ["toy.json", "libtoy.so", "invalid ELF header", "remedy: install the driver of"],
        ),
        (&absent, ["absent.json", "cannot be read", "No such file", "remedy: correct or remove"]),
        (desk.output.path(), ["no driver manifest in", "VK_DRIVER_FILES=", "remedy: correct", "unset it"]),
    ] {
        let listed = Outcome::from_command(with_drivers(manifest, &["--list-devices"]));
        listed.assert_success();
        assert!(listed.out.starts_with("the loader ") && listed.out.lines().count() >= 4, "{}", listed.out);
        assert_names(&listed.out, &parts);
        let run = Outcome::from_command(with_drivers(manifest, &["--scene", &scene]));
        run.assert_error(1, &parts);
        assert_names(&run.err, &["no Vulkan device on this machine: the loader "]);
    }
}

/// The software driver takes the place of a system whose loader cannot be opened.
#[test]
#[cfg(target_os = "linux")]
fn the_reason_for_the_software_driver_is_one_line_and_the_list_has_the_rest() {
    if !has_device() || std::env::var_os("VK_DRIVER_FILES").is_some() {
        return;
    }
    let desk = Desk::new();
    desk.file("libvulkan.so.1", "");
    let (out, err) = {
        let mut command = hybrid(&["--list-devices"]);
        command
            .env_remove("LVK_DRIVER")
            .env_remove("VK_ICD_FILENAMES")
            .env("LD_LIBRARY_PATH", desk.input.path());
        let Output { stdout, stderr, .. } = command.output().unwrap();
        (String::from_utf8(stdout).unwrap(), String::from_utf8(stderr).unwrap())
    };
    let note = "lvk: a software driver is used, because the Vulkan loader libvulkan.so.1 cannot be opened\n";
    assert_eq!(err, note);
    assert!(out.starts_with("[0] "), "{out}");
    assert_names(
        &out,
        &["\nthe system's own Vulkan, which", "\nthe loader libvulkan.so.1 cannot be opened: ", "\nremedy: "],
    );
}

/// Neither a loader nor a driver, and none may be fetched.
#[test]
#[cfg(target_os = "linux")]
fn a_machine_without_a_loader_lists_what_to_install() {
    let empty = tempfile::tempdir().unwrap();
    let without_vulkan = |args: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_hybrid"));
        command.args(args).env("LVK_NO_DOWNLOAD", "1").env("LVK_VULKAN_DIR", empty.path());
        for variable in ["LVK_DRIVER", "LVK_DEVICE", "VK_ICD_FILENAMES", "VK_DRIVER_FILES"] {
            command.env_remove(variable);
        }
        for variable in ["XDG_CONFIG_DIRS", "XDG_DATA_DIRS", "HOME"] {
            command.env(variable, empty.path());
        }
        // A file in the place of the loader comes before the system's.
        std::fs::write(empty.path().join("libvulkan.so.1"), "").unwrap();
        Outcome::from_command({
            command.env("LD_LIBRARY_PATH", empty.path());
            command
        })
    };
    let listed = without_vulkan(&["--list-devices"]);
    listed.assert_success();
    assert_names(
        &listed.out,
        &[
            "the loader libvulkan.so.1 cannot be opened: ",
            "remedy: ",
            "cannot be downloaded because LVK_NO_DOWNLOAD",
        ],
    );
    let run = without_vulkan(&[]);
    run.assert_error(
        1,
        &["no Vulkan driver with ray tracing", "the loader libvulkan.so.1 cannot", "LVK_NO_DOWNLOAD"],
    );
}

#[test]
fn samples_with_one_scene_list_it_and_all_list_devices() {
    if !has_device() {
        return;
    }
    for (program, scene) in [
        (env!("CARGO_BIN_EXE_hybrid_oit"), "room  built in"),
        (env!("CARGO_BIN_EXE_reflections"), "hall  built in"),
    ] {
        let mut command = Command::new(program);
        command.arg("--list-scenes");
        let outcome = Outcome::from_command(command);
        outcome.assert_success();
        assert!(outcome.out.starts_with(scene), "{}", outcome.out);
        let mut command = Command::new(program);
        command.arg("--list-devices");
        let outcome = Outcome::from_command(command);
        outcome.assert_success();
        assert!(outcome.out.starts_with("[0] "), "{}", outcome.out);
    }
}

#[test]
fn a_device_that_is_not_there_is_device_trouble() {
    let Some((desk, scene)) = desk_with_device() else { return };
    desk.run(&["--scene", &scene, "--device", "voodoo"])
        .assert_error(1, &["'voodoo' names no device", "[0] "]);
    assert_eq!(desk.output_files(), Vec::<String>::new());
}

#[test]
fn a_device_without_ray_tracing_gets_a_message_of_what_it_lacks() {
    let Some((desk, scene)) = desk_with_device() else { return };
    let lacks =
        [("pipeline", "lacks ray tracing pipelines", ""), ("query", "lacks ray queries", "--rt software")];
    for (rt, lack, remedy) in lacks {
        let Some(command) = desk.without_ray_tracing(&["--scene", &scene, "--rt", rt]) else { return };
        Outcome::from_command(command).assert_error(1, &["SwiftShader", lack, remedy]);
    }
    let other = desk.run(&["--scene", &scene, "--rt", "query", "--device", "voodoo"]);
    assert!(!other.err.contains("--rt software"), "{}", other.err);
    assert_eq!(desk.output_files(), Vec::<String>::new());
}

#[test]
fn a_device_that_finds_no_visible_triangles_traces_everything() {
    let Some((desk, scene)) = desk_with_device() else { return };
    for named in [&["--method", "hybrid"][..], &["--raster", "compute"], &["--bounces", "first"]] {
        let args = [&["--scene", &scene, "--rt", "software"], named].concat();
        let Some(command) = desk.without_ray_tracing(&args) else { return };
        Outcome::from_command(command)
            .assert_error(1, &["SwiftShader", "64-bit atomics", "--method standalone"]);
    }
    for rt in ["auto", "software"] {
        let Some(command) = desk.without_ray_tracing(&["--scene", &scene, "--rt", rt]) else { return };
        let Outcome { status, out, err } = Outcome::from_command(command);
        assert_eq!(status, Some(0), "{out}{err}");
        assert!(out.contains("stand-alone ray tracing") && out.contains("in software"), "{out}");
        assert!(err.contains("warning: SwiftShader") && err.contains("--method standalone"), "{err}");
        assert_eq!(desk.image_size(), (WIDTH, HEIGHT));
    }
}

#[test]
fn without_a_driver_and_a_way_to_one_the_user_learns_what_to_install() {
    let desk = Desk::new();
    let scene = desk.file("triangle.obj", TRIANGLE);
    let empty = tempfile::tempdir().unwrap();
    let mut command = desk.command(&["--scene", &scene]);
    command.env("LVK_NO_DOWNLOAD", "1").env("LVK_VULKAN_DIR", empty.path()).env("LVK_DRIVER", "software");
    command.env_remove("VK_DRIVER_FILES").env_remove("VK_ICD_FILENAMES");
    let start = Instant::now();
    Outcome::from_command(command).assert_error(1, &["LVK_NO_DOWNLOAD", "apt install mesa-vulkan-drivers"]);
    assert!(start.elapsed() < Duration::from_secs(5), "{:?}", start.elapsed());
    assert_eq!(desk.output_files(), Vec::<String>::new());
    assert_eq!(fs::read_dir(empty.path()).unwrap().count(), 0, "nothing was begun");
}

/// The path follows from what the profile leaves, and the first lines say which profile and which path.
#[test]
fn a_profile_decides_the_path_and_is_printed() {
    let Some((desk, scene)) = desk_with_device() else { return };
    for (profile, path) in [("mali-g715", "ray queries"), ("no-ray-query", "ray tracing pipeline")] {
        let outcome = desk.run(&["--scene", &scene, "--frames", "1", "--profile", profile, "--validate"]);
        outcome.assert_success();
        let told = format!("profile   {profile}, ");
        assert_names(&outcome.out, &[&told, path, "validation messages: 0"]);
    }
    let wish = ["--scene", &scene, "--frames", "1", "--profile", "no-ray-tracing", "--validate", "--rt"];
    for (rt, lacks) in [("pipeline", "lacks ray tracing pipelines"), ("query", "lacks ray queries")] {
        let parts = [lacks, "hidden by the device profile 'no-ray-tracing'"];
        desk.run(&[&wish[..], &[rt]].concat()).assert_error(1, &parts);
    }
    for (rt, why) in
        [("software", "software was asked for"), ("auto", "the device has no ray queries of its own")]
    {
        let outcome = desk.run(&[&wish[..], &[rt]].concat());
        outcome.assert_success();
        assert_names(&outcome.out, &[&format!("in software ({why})"), "validation messages: 0"]);
    }
}

/// The phone takes the courtyard in parts only, and the picture is made all the same.
#[test]
fn a_scene_too_large_for_the_profile_is_split_and_reported() {
    if !has_device() {
        return;
    }
    let desk = Desk::new();
    let outcome = desk.run(&["--profile", "mali-g715", "--frames", "1", "--validate"]);
    outcome.assert_success();
    let told = ["profile   mali-g715", "courtyard: 276930 triangles", "validation messages: 0"];
    assert_names(&outcome.out, &told);
    // 95,700 triangles are the 256 MiB of scratch that the phone takes.
    let parts = outcome.out.split_once("2 BLAS, split into ").and_then(|(_, rest)| rest.split_once(" parts"));
    let parts: u32 = parts.and_then(|(number, _)| number.parse().ok()).unwrap_or_default();
    assert!(parts >= 4, "{}", outcome.out);
    assert_eq!(desk.image_size(), (WIDTH, HEIGHT));
}

/// `hybrid | head -1` must not keep the picture from being written.
#[test]
fn a_closed_pipe_does_not_cost_the_image() {
    let Some((desk, scene)) = desk_with_device() else { return };
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let mut command = desk.command(&["--scene", &scene]);
    let status = command.stdout(writer).status().unwrap();
    assert_eq!(status.code(), Some(0));
    assert_eq!(desk.image_size(), (WIDTH, HEIGHT));
}
