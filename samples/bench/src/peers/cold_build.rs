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

/// Returns the seconds that `cargo build --release` takes for a program and all of its dependencies, which are on the disk
/// already.
pub(super) fn cold_build_seconds(program: &Program) -> Result<f64, Failure> {
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
    let start = Instant::now();
    finish(cargo().args(["build", "--release", "--offline"]))?;
    Ok(start.elapsed().as_secs_f64())
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
    fn the_manifest_names_the_repository() {
        let program = Program { label: "a", dependencies: "lvk = { path = \"{root}/lvk\" }", files: &[] };
        let text = manifest(&program, Path::new("/r"));
        assert!(text.contains("lvk = { path = \"/r/lvk\" }") && text.contains("[workspace]"), "{text}");
    }

    #[test]
    fn a_program_without_dependencies_is_built() {
        let files: &[(&str, &[u8])] = &[("a.rs", b"fn main() {}")];
        let seconds = cold_build_seconds(&Program { label: "a", dependencies: "", files }).unwrap();
        assert!(seconds > 0.0);
        let wrong: &[(&str, &[u8])] = &[("a.rs", b"fn main() { nothing(); }")];
        let error = cold_build_seconds(&Program { label: "a", dependencies: "", files: wrong }).unwrap_err();
        assert!(error.to_string().contains("nothing"), "{error}");
    }
}
