//! Runs of the `hybrid` program: its input and output files, and the result.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};
use std::sync::Once;

use lvk_dev_driver::{DriverRequest, prepare_unless_skipped, swiftshader_icd};
use tempfile::TempDir;

pub(crate) const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
pub(crate) const WIDTH: u32 = 64;
pub(crate) const HEIGHT: u32 = 36;

/// A folder of input files and an empty one for output.
pub(crate) struct Desk {
    pub(crate) input: TempDir,
    pub(crate) output: TempDir,
}

/// The result of a run of the program.
pub(crate) struct Outcome {
    pub(crate) status: Option<i32>,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl Desk {
    pub(crate) fn new() -> Self {
        Self { input: tempfile::tempdir().unwrap(), output: tempfile::tempdir().unwrap() }
    }

    /// Writes an input file and returns its path.
    pub(crate) fn file(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        let path = self.input.path().join(name);
        fs::write(&path, content).unwrap();
        path.display().to_string()
    }

    pub(crate) fn output_path(&self) -> PathBuf {
        self.output.path().join("picture.png")
    }

    /// The program with a small picture as its output.
    pub(crate) fn command(&self, args: &[&str]) -> Command {
        let mut command = hybrid(args);
        command.arg("--out").arg(self.output_path());
        command.args(["--width", &WIDTH.to_string(), "--height", &HEIGHT.to_string()]);
        command
    }

    /// The same on a device without ray tracing; `None`, loudly, where that cannot be had.
    pub(crate) fn without_ray_tracing(&self, args: &[&str]) -> Option<Command> {
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

    pub(crate) fn run(&self, args: &[&str]) -> Outcome {
        Outcome::from_command(self.command(args))
    }

    pub(crate) fn output_files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.output.path()).unwrap();
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    }

    /// The size of the picture, which is the only file that was written.
    pub(crate) fn image_size(&self) -> (u32, u32) {
        assert_eq!(self.output_files(), ["picture.png"]);
        image::open(self.output_path()).unwrap().into_rgba8().dimensions()
    }
}

impl Outcome {
    pub(crate) fn from_command(mut command: Command) -> Self {
        let Output { status, stdout, stderr } = command.output().unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        Self { status: status.code(), out: text(stdout), err: without_driver_note(&text(stderr)) }
    }

    /// Fails unless the program ended with `status` and one line of error, which names all of `parts`.
    pub(crate) fn assert_error(&self, status: i32, parts: &[&str]) {
        let Self { out, err, .. } = self;
        assert_eq!(self.status, Some(status), "{parts:?}: {out}{err}");
        assert!(err.starts_with("error: ") && err.ends_with('\n') && err.lines().count() == 1, "{err}");
        assert_names(err, parts);
        assert!(err.len() > "error: ".len() + 20, "{err}");
    }

    /// As [`assert_error`](Self::assert_error), for mistakes in the command line itself, whose message goes on with a
    /// hint.
    pub(crate) fn assert_usage_error(&self, parts: &[&str]) {
        assert_eq!(self.status, Some(2), "{}", self.err);
        let first = self.err.lines().next().unwrap_or_default();
        assert!(first.starts_with("error: "), "{}", self.err);
        assert_names(&self.err, parts);
    }

    pub(crate) fn assert_success(&self) {
        assert_eq!(self.status, Some(0), "{}{}", self.out, self.err);
    }
}

/// Leaves out the line that gives the reason for the software driver, on machines that need it.
pub(crate) fn without_driver_note(err: &str) -> String {
    err.split_inclusive('\n')
        .filter(|line| !line.starts_with("lvk: a software driver is used, because "))
        .collect()
}

pub(crate) fn assert_names(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "no `{part}` in: {text}");
    }
}

/// The program; on a machine without a driver it has fetched what it needs already, and said so.
pub(crate) fn hybrid(args: &[&str]) -> Command {
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
pub(crate) fn has_device() -> bool {
    prepare_unless_skipped(&DriverRequest { validation: true, quick_compilation: true }).unwrap()
}

/// A desk with a scene, where a device can render it.
pub(crate) fn desk_with_device() -> Option<(Desk, String)> {
    has_device().then(|| {
        let desk = Desk::new();
        let scene = desk.file("triangle.obj", TRIANGLE);
        (desk, scene)
    })
}
