//! Samples as processes with folders of their own, and checks of what they leave.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::os::unix::process::ExitStatusExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus};
use std::sync::OnceLock;
use std::time::{Duration, Instant, SystemTime};

use lvk_dev_driver::{DriverRequest, prepare_unless_skipped};
use tempfile::TempDir;

/// Longest time of a run. The machine may be busy.
pub(crate) const PATIENCE: Duration = Duration::from_secs(180);

const OBJ: &str =
    "v -2 -2 0\nv 2 -2 0\nv 0 2 0\nv -9 -9 -3\nv 9 -9 -3\nv 9 9 -3\nv -9 9 -3\nf 1 2 3\nf 4 5 6 7\n";

/// The task of a process. Each has caches of pipelines and shaders.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Task {
    /// A picture of the smallest sample that traces rays, with a cache of trees.
    Small,
    /// A sequence of pictures of that sample. Pictures that are there are not rendered again.
    Sequence,
    /// A picture of `hybrid`, traced by software, with a cache of trees.
    Hybrid,
    /// A picture of `large_scene`, with a cache of acceleration structures.
    Structures,
}

impl Task {
    pub(crate) const ALL: [Self; 4] = [Self::Small, Self::Sequence, Self::Hybrid, Self::Structures];

    /// Every task, with its share of so many processes: those that take less time are more.
    pub(crate) fn shares(count: usize) -> [(Self, usize); 4] {
        [(Self::Small, 3), (Self::Sequence, 3), (Self::Hybrid, 1), (Self::Structures, 1)]
            .map(|(task, share)| (task, (count * share).div_ceil(8)))
    }

    fn program(self) -> &'static str {
        match self {
            Self::Small | Self::Sequence => env!("CARGO_BIN_EXE_rtx_hello"),
            Self::Hybrid => env!("CARGO_BIN_EXE_hybrid"),
            Self::Structures => env!("CARGO_BIN_EXE_large_scene"),
        }
    }

    fn args(self) -> &'static [&'static str] {
        match self {
            Self::Small => &["--rt", "software", "--frames", "1"],
            Self::Sequence => &["--rt", "software", "--round", "9", "--frames", "0..8", "--resume"],
            Self::Hybrid => &["--rt", "software", "--frames", "1", "--depth", "2"],
            Self::Structures => &["--triangles", "2000", "--copies", "4", "--samples", "1", "--frames", "1"],
        }
    }

    pub(crate) fn file_name(self) -> &'static str {
        match self {
            Self::Small | Self::Hybrid | Self::Structures => "picture.png",
            Self::Sequence => "frame_####.png",
        }
    }

    /// The pictures of a run that nothing disturbs, by name.
    pub(crate) fn expected(self) -> &'static Expected {
        static ALL: [OnceLock<Expected>; Task::ALL.len()] = [const { OnceLock::new() }; Task::ALL.len()];
        ALL[self as usize].get_or_init(|| {
            // The second run takes as long as those that follow: the driver has kept its compiled shaders.
            Desk::new(self).run().assert_success();
            let desk = Desk::new(self);
            let start = Instant::now();
            desk.run().assert_success();
            let length = start.elapsed();
            let [pictures, caches] = [desk.output(), desk.cache()].map(|folder| paths(&folder));
            assert_ne!((pictures.len(), caches.len()), (0, 0));
            let files = pictures.len() + caches.len();
            let pictures = pictures.iter().map(|path| (name(path), fs::read(path).unwrap())).collect();
            Expected { pictures, length, files }
        })
    }
}

/// The result of a run that nothing disturbs, on cold caches.
pub(crate) struct Expected {
    pictures: BTreeMap<String, Vec<u8>>,
    pub(crate) length: Duration,
    /// Number of files that it writes.
    pub(crate) files: usize,
}

/// Folders for the input, the caches and the pictures of a task.
pub(crate) struct Desk {
    pub(crate) task: Task,
    root: TempDir,
}

/// A process that has ended.
#[derive(Debug)]
pub(crate) struct Ended {
    pub(crate) status: ExitStatus,
    pub(crate) err: String,
}

impl Desk {
    pub(crate) fn new(task: Task) -> Self {
        let root = tempfile::tempdir().unwrap();
        fs::write(root.path().join("scene.obj"), OBJ).unwrap();
        let desk = Self { task, root };
        fs::create_dir(desk.cache()).unwrap();
        fs::create_dir(desk.output()).unwrap();
        desk
    }

    pub(crate) fn cache(&self) -> PathBuf {
        self.root.path().join("cache")
    }

    pub(crate) fn output(&self) -> PathBuf {
        self.root.path().join("pictures")
    }

    /// The file for a process's standard error.
    fn log(&self, number: usize) -> PathBuf {
        self.root.path().join(format!("log-{number}"))
    }

    /// The arguments of a run, with the program first.
    pub(crate) fn words(&self) -> Vec<String> {
        self.words_to(&self.output().join(self.task.file_name()))
    }

    /// As [`words`](Self::words), for another path of the pictures.
    pub(crate) fn words_to(&self, out: &Path) -> Vec<String> {
        let mut words = vec![self.task.program().to_owned()];
        words.extend(["--width", "64", "--height", "36", "--out"].map(str::to_owned));
        words.push(out.display().to_string());
        if self.task == Task::Hybrid {
            words.extend(["--scene".to_owned(), self.root.path().join("scene.obj").display().to_string()]);
        }
        words.extend(self.task.args().iter().map(|word| (*word).to_owned()));
        words
    }

    /// The command of `words`, with the caches of this desk.
    pub(crate) fn command(&self, words: &[String]) -> Command {
        // The driver keeps compiled shaders, too. Killed processes must not harm those of other tests.
        static DRIVER_CACHE: OnceLock<TempDir> = OnceLock::new();
        let driver_cache = DRIVER_CACHE.get_or_init(|| tempfile::tempdir().unwrap());
        let mut command = Command::new(&words[0]);
        command.args(&words[1..]).env_remove("LVK_DEVICE").env_remove("LVK_SCENES");
        command.env("LVK_CACHE", self.cache()).env("MESA_SHADER_CACHE_DIR", driver_cache.path());
        command
    }

    /// Starts the task; `number` tells processes of one desk apart.
    pub(crate) fn start(&self, number: usize) -> Child {
        self.start_command(self.command(&self.words()), number)
    }

    pub(crate) fn start_command(&self, mut command: Command, number: usize) -> Child {
        command.stdout(std::process::Stdio::null()).stderr(File::create(self.log(number)).unwrap());
        command.spawn().unwrap()
    }

    /// Waits for a process that [`start`](Self::start) has started, and kills it if it hangs.
    pub(crate) fn wait(&self, mut child: Child, number: usize) -> Ended {
        let start = Instant::now();
        let status = loop {
            match child.try_wait().unwrap() {
                Some(status) => break status,
                None if start.elapsed() < PATIENCE => std::thread::sleep(Duration::from_millis(2)),
                None => {
                    child.kill().unwrap();
                    child.wait().unwrap();
                    panic!("the program hangs: {}", fs::read_to_string(self.log(number)).unwrap());
                }
            }
        };
        let err = fs::read_to_string(self.log(number)).unwrap();
        let is_note = |line: &&str| line.starts_with("lvk: a software driver is used, because ");
        Ended { status, err: err.split_inclusive('\n').filter(|line| !is_note(line)).collect() }
    }

    pub(crate) fn run(&self) -> Ended {
        self.run_command(self.command(&self.words()))
    }

    pub(crate) fn run_command(&self, command: Command) -> Ended {
        self.wait(self.start_command(command, 0), 0)
    }

    /// Fails unless every picture is whole and equal to that of a run that nothing disturbs.
    pub(crate) fn assert_whole(&self) {
        assert_whole_in(self.task, &self.output());
        for path in paths(&self.cache()).iter().filter(|path| !is_temporary(path)) {
            let extension = path.extension().and_then(|extension| extension.to_str());
            let is_known = matches!(extension, Some("pipelines" | "spirv" | "tree" | "blas"));
            assert!(is_known, "{} is no file of the caches", path.display());
        }
    }

    /// Fails unless every picture is there and right.
    pub(crate) fn assert_complete(&self) {
        self.assert_whole();
        assert_complete_in(self.task, &self.output());
    }

    /// Temporary files that are left.
    pub(crate) fn leftovers(&self) -> Vec<PathBuf> {
        let all = [self.cache(), self.output()].into_iter().flat_map(|folder| paths(&folder));
        all.filter(|path| is_temporary(path)).collect()
    }

    /// Lets every temporary file look as if it was written two hours ago.
    pub(crate) fn age_leftovers(&self) {
        for path in self.leftovers() {
            let file = File::options().append(true).open(path).unwrap();
            file.set_modified(SystemTime::now() - Duration::from_secs(7200)).unwrap();
        }
    }

    /// Runs the task again. Fails unless that works as on caches that nothing has disturbed.
    pub(crate) fn assert_next_start(&self) {
        let ended = self.run();
        ended.assert_success();
        assert!(!ended.err.contains("warning"), "{}", ended.err);
        self.assert_complete();
    }
}

impl Ended {
    pub(crate) fn assert_success(&self) {
        assert_eq!(self.status.code(), Some(0), "{:?}: {}", self.status, self.err);
    }

    /// Fails unless the process ended with status 2 and one line of error that names all of `parts`.
    pub(crate) fn assert_error(&self, parts: &[&str]) {
        assert_eq!(self.status.code(), Some(2), "{:?}: {}", self.status, self.err);
        let errors: Vec<_> = self.err.lines().filter(|line| line.starts_with("error: ")).collect();
        assert_eq!(errors.len(), 1, "{}", self.err);
        for part in parts {
            assert!(errors[0].contains(part), "no `{part}` in: {}", self.err);
        }
    }

    /// Lines that warn.
    pub(crate) fn warnings(&self) -> Vec<&str> {
        self.err.lines().filter(|line| line.starts_with("warning: ")).collect()
    }

    /// True if `signal` has ended the process.
    pub(crate) fn is_by_signal(&self, signal: i32) -> bool {
        self.status.signal() == Some(signal)
    }
}

/// Fails unless every picture in a folder is whole, and all other files there are temporary.
pub(crate) fn assert_whole_in(task: Task, folder: &Path) {
    let expected = task.expected();
    for path in paths(folder).iter().filter(|path| !is_temporary(path)) {
        let right = expected.pictures.get(&name(path));
        let right = right.unwrap_or_else(|| panic!("{} is no picture of {task:?}", path.display()));
        assert!(image::open(path).is_ok(), "{} is no whole PNG", path.display());
        assert!(&fs::read(path).unwrap() == right, "{} is another picture", path.display());
    }
}

/// Fails unless every picture of the task is in a folder.
pub(crate) fn assert_complete_in(task: Task, folder: &Path) {
    assert_whole_in(task, folder);
    let found = paths(folder).iter().filter(|path| !is_temporary(path)).count();
    assert_eq!(found, task.expected().pictures.len(), "pictures of {task:?}");
}

/// True for names of temporary files. These are random.
pub(crate) fn is_temporary(path: &Path) -> bool {
    let name = name(path);
    name.ends_with(".tmp") || name.starts_with(".lvk-") && name.ends_with(".partial")
}

/// Paths of all files below a folder. Files may appear and vanish meanwhile.
pub(crate) fn paths(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let mut all = Vec::new();
    for entry in entries.flatten() {
        match entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            true => all.extend(paths(&entry.path())),
            false => all.push(entry.path()),
        }
    }
    all
}

fn name(path: &Path) -> String {
    path.file_name().unwrap().to_str().unwrap().to_owned()
}

/// True if a device was found. Returns false and prints a line without a device, if `LVK_SKIP_GPU_TESTS` allows that.
pub(crate) fn has_device() -> bool {
    prepare_unless_skipped(&DriverRequest { validation: false, quick_compilation: true }).unwrap()
}
