//! Builds the triangle of a library in an empty folder.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use super::answer::one_line;
use super::peer::Failure;
use super::program::Program;

/// The folder of the repository.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Time of a build.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BuildTime {
    /// Seconds from begin to end.
    pub(super) seconds: f64,
    /// Seconds of all cores together, where the system tells. Other programs affect them less.
    pub(super) cpu_seconds: Option<f64>,
}

/// Returns the time that `cargo build --release` takes for a program and all of its dependencies, which are on the disk
/// already.
pub(super) fn cold_build(program: &Program) -> Result<BuildTime, Failure> {
    let folder = tempfile::tempdir()?;
    let root = root().canonicalize()?;
    std::fs::create_dir(folder.path().join("src"))?;
    for (number, (name, bytes)) in program.files.iter().enumerate() {
        let name = if number == 0 { "main.rs" } else { name };
        std::fs::write(folder.path().join("src").join(name), bytes)?;
    }
    std::fs::write(folder.path().join("Cargo.toml"), manifest(program, &root))?;
    // The versions are those of the repository.
    std::fs::copy(root.join("Cargo.lock"), folder.path().join("Cargo.lock"))?;
    let cargo = || {
        let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
        command.current_dir(folder.path()).env("CARGO_TARGET_DIR", folder.path().join("target"));
        command
    };
    finish(cargo().arg("fetch"))?;
    let (start, before) = (Instant::now(), cpu_seconds_of_children());
    finish(cargo().args(["build", "--release", "--offline"]))?;
    let seconds = start.elapsed().as_secs_f64();
    let cpu_seconds = before.zip(cpu_seconds_of_children()).map(|(before, after)| after - before);
    Ok(BuildTime { seconds, cpu_seconds })
}

/// Returns the seconds that all processes have run which this one has started and waited for; `None` without Linux.
fn cpu_seconds_of_children() -> Option<f64> {
    children_seconds(&std::fs::read_to_string("/proc/self/stat").ok()?)
}

/// Reads the fields `cutime` and `cstime` of `/proc/PID/stat`, in hundredths of a second.
fn children_seconds(stat: &str) -> Option<f64> {
    // The name of the program is the only field that may have spaces and brackets.
    let (_, fields) = stat.rsplit_once(')')?;
    let mut numbers = fields.split_whitespace().skip(13).map_while(|field| field.parse::<f64>().ok());
    Some((numbers.next()? + numbers.next()?) / 100.0)
}

fn finish(command: &mut Command) -> Result<(), Failure> {
    let output = command.output()?;
    if output.status.success() {
        return Ok(());
    }
    let text = String::from_utf8_lossy(&output.stderr);
    let errors: Vec<&str> = text.lines().filter(|line| line.starts_with("error")).collect();
    Err(format!("cargo failed: {}", one_line(&errors.join(" "))).into())
}

fn manifest(program: &Program, root: &Path) -> String {
    let dependencies = program.dependencies.replace("{root}", &root.display().to_string());
    format!(
        "[package]\nname = \"triangle\"\nversion = \"0.1.0\"\nedition = \"2024\"\n\n[workspace]\n\n[dependencies]\n\
         {dependencies}\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_children_are_two_fields_of_the_status() {
        let fields: Vec<String> = (3..=20).map(|field: u32| field.to_string()).collect();
        let stat = format!("1 (a) b (c)) {}", fields.join(" "));
        assert_eq!(children_seconds(&stat), Some((16.0 + 17.0) / 100.0));
        assert_eq!(children_seconds("1 (a) S 1"), None);
    }

    #[test]
    fn the_manifest_names_the_repository() {
        let program = Program { label: "a", dependencies: "lvk = { path = \"{root}/lvk\" }", files: &[] };
        let text = manifest(&program, Path::new("/r"));
        assert!(text.contains("lvk = { path = \"/r/lvk\" }") && text.contains("[workspace]"), "{text}");
    }

    #[test]
    fn a_program_without_dependencies_is_built() {
        let files: &[(&str, &[u8])] = &[("a.rs", b"fn main() {}")];
        let time = cold_build(&Program { label: "a", dependencies: "", files }).unwrap();
        assert!(time.seconds > 0.0 && time.cpu_seconds.is_none_or(|seconds| seconds > 0.0), "{time:?}");
        let wrong: &[(&str, &[u8])] = &[("a.rs", b"fn main() { nothing(); }")];
        let error = cold_build(&Program { label: "a", dependencies: "", files: wrong }).unwrap_err();
        assert!(error.to_string().contains("nothing"), "{error}");
    }
}
