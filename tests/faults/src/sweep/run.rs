//! Runs a program once under the layer.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use lvk_layer::{LayerDescription, LayerFolder};

use super::verdict::{Ending, NextStart, RunOutcome};
use crate::call_log::CallLog;
use crate::fault::{Fault, Span};
use crate::layer::{FAULT_VARIABLE, LOG_VARIABLE, NAMES_VARIABLE};

/// Longest time of one run: a busy machine needs a minute for a program that starts in two seconds.
const TIMEOUT: Duration = Duration::from_secs(600);
/// File of the first result, in the folder that the program gets as its first argument.
pub const FIRST: &str = "first.png";
/// File of the second result.
pub const SECOND: &str = "second.png";
/// Environment variable that tells the program to try again after a failure.
pub const AGAIN_VARIABLE: &str = "LVK_FAULT_AGAIN";

/// A program to run under the layer: `PROGRAM FOLDER ARGUMENTS...`, which writes [`FIRST`] and perhaps [`SECOND`].
#[derive(Clone, Debug)]
pub struct Program {
    /// Path of the program.
    pub path: PathBuf,
    /// Arguments after the folder.
    pub args: Vec<String>,
    /// Further environment variables.
    pub variables: Vec<(String, String)>,
    /// Caches that the program finds when a call fails.
    pub caches: Caches,
    /// True if the program can try again after a failure.
    pub tries_again: bool,
}

/// Caches of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Caches {
    /// Those of a run before.
    Warm,
    /// None: the program writes them while a call fails.
    Cold,
}

/// Describes the layer of this crate to the Vulkan loader.
///
/// # Errors
/// Those of files; `NotFound` where the library was not built.
pub fn fault_layer() -> io::Result<LayerFolder> {
    LayerFolder::new(&LayerDescription {
        name: "VK_LAYER_LVK_faults",
        description: "Makes calls fail",
        library: "lvk_faults",
        enabled_by: "LVK_FAULT_LAYER",
        disabled_by: "LVK_NO_FAULT_LAYER",
        pre_instance_functions: &[
            ("vkEnumerateInstanceVersion", "lvk_fault_instance_version"),
            ("vkEnumerateInstanceExtensionProperties", "lvk_fault_instance_extensions"),
            ("vkEnumerateInstanceLayerProperties", "lvk_fault_instance_layers"),
        ],
    })
}

/// Runs the program. Without a fault it uses `caches` itself and fills them. With one it uses a
/// copy, and where that has changed the program is started once more, without a fault.
///
/// # Errors
/// Those of files and processes.
pub fn run(
    program: &Program,
    layer: &LayerFolder,
    caches: &Path,
    fault: Option<&Fault>,
) -> io::Result<RunOutcome> {
    let folder = tempfile::tempdir()?;
    let used = match fault {
        Some(_) => copied(caches, &folder.path().join("caches"))?,
        None => caches.to_owned(),
    };
    let mut outcome = run_in(folder.path(), program, layer, &used, fault)?;
    if fault.is_some() && contents(&used)? != contents(caches)? {
        let folder = tempfile::tempdir()?;
        let next = run_in(folder.path(), program, layer, &used, None)?;
        outcome.next = Some(NextStart { ending: next.ending, result: next.result, stderr: next.stderr });
    }
    Ok(outcome)
}

/// Runs the program in `folder` with the caches `used`.
fn run_in(
    folder: &Path,
    program: &Program,
    layer: &LayerFolder,
    used: &Path,
    fault: Option<&Fault>,
) -> io::Result<RunOutcome> {
    let (out, log) = (folder.join("out"), folder.join("log"));
    fs::create_dir(&out)?;
    let stderr = fs::File::create(folder.join("stderr"))?;
    let mut command = Command::new(&program.path);
    command.arg(&out).args(&program.args).stdin(Stdio::null()).stdout(Stdio::null()).stderr(stderr);
    layer.enable(&mut command);
    command
        .env("LVK_CACHE", used)
        .env(LOG_VARIABLE, &log)
        .env_remove(FAULT_VARIABLE)
        .env_remove(NAMES_VARIABLE)
        .env_remove(AGAIN_VARIABLE);
    command.envs(program.variables.iter().map(|(name, value)| (name, value)));
    // A fault that stays hinders a second try, too.
    let tries_again = program.tries_again && fault.is_some_and(|fault| fault.span == Span::Once);
    if tries_again {
        command.env(AGAIN_VARIABLE, "1");
    }
    command.envs(fault.map(|fault| (FAULT_VARIABLE, fault.to_string())));
    let ending = end(&mut command.spawn()?)?;
    let log = CallLog::parse(&String::from_utf8_lossy(&fs::read(&log).unwrap_or_default()));
    let mut files = BTreeSet::new();
    list(&out, "out", &mut files)?;
    list(used, "caches", &mut files)?;
    for result in [FIRST, SECOND] {
        files.remove(&format!("out/{result}"));
    }
    Ok(RunOutcome {
        ending,
        stderr: String::from_utf8_lossy(&fs::read(folder.join("stderr"))?).into_owned(),
        reached: log.reached,
        calls: log.calls,
        failed: log.failed,
        told_others: log.told_others,
        counts_objects: log.counts_objects,
        live: log.live,
        orphans: log.orphans,
        orphaning: log.orphaning,
        dead: log.dead,
        unready: log.unready,
        names: log.names,
        devices: log.devices,
        leftovers: log.leftovers,
        result: fs::read(out.join(FIRST)).ok(),
        second_result: fs::read(out.join(SECOND)).ok(),
        tries_again,
        files,
        next: None,
    })
}

fn end(child: &mut Child) -> io::Result<Ending> {
    let start = Instant::now();
    while start.elapsed() < TIMEOUT {
        if let Some(status) = child.try_wait()? {
            return Ok(ending(status));
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill()?;
    child.wait()?;
    Ok(Ending::Hang)
}

fn ending(status: ExitStatus) -> Ending {
    match (status.code(), status.signal()) {
        (Some(code), _) => Ending::Status(code),
        (None, signal) => Ending::Signal(signal.unwrap_or_default()),
    }
}

/// Returns the bytes of each file of a folder, by its path.
fn contents(folder: &Path) -> io::Result<BTreeMap<String, Vec<u8>>> {
    let mut names = BTreeSet::new();
    list(folder, "", &mut names)?;
    names
        .into_iter()
        .map(|name| Ok((name.clone(), fs::read(folder.join(name.trim_start_matches('/')))?)))
        .collect()
}

/// Adds the files of a folder, by paths that start with `name`.
fn list(folder: &Path, name: &str, files: &mut BTreeSet<String>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = format!("{name}/{}", entry.file_name().to_string_lossy());
        match entry.file_type()?.is_dir() {
            true => list(&entry.path(), &name, files)?,
            false => drop(files.insert(name)),
        }
    }
    Ok(())
}

fn copied(from: &Path, to: &Path) -> io::Result<PathBuf> {
    fs::create_dir(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let target = to.join(entry.file_name());
        match entry.file_type()?.is_dir() {
            true => drop(copied(&entry.path(), &target)?),
            false => drop(fs::copy(entry.path(), target)?),
        }
    }
    Ok(to.to_owned())
}
