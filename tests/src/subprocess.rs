//! Runs a test in a process of its own, because a process reads some environment variables once.
#![expect(clippy::expect_used, reason = "a test whose process cannot be started has failed")]

use std::ffi::OsStr;
use std::path::Path;
use std::process::Command;

use crate::device::{radv, swiftshader};

const MARK: &str = "LVK_TEST_CHILD";

/// Runs `body` in a new process with `variables` set, or removed if they have no value.
///
/// `test` is the calling test itself: the new process runs it alone, and it calls this function again, which then
/// runs `body`.
///
/// # Panics
/// When the process fails; the message has its output.
pub fn in_subprocess(test: impl Fn(), variables: &[(&str, Option<&OsStr>)], body: impl FnOnce()) {
    output_of_subprocess(test, variables, body);
}

/// As [`in_subprocess`]. Returns the standard output of the new process, and `None` in that process.
///
/// # Panics
/// As [`in_subprocess`].
pub fn output_of_subprocess(
    test: impl Fn(),
    variables: &[(&str, Option<&OsStr>)],
    body: impl FnOnce(),
) -> Option<String> {
    let test = test_path(&test);
    if std::env::var_os(MARK).is_some_and(|name| name == test) {
        body();
        return None;
    }
    let mut command = program(variables);
    command.args([test, "--exact", "--nocapture", "--include-ignored"]).env(MARK, test);
    let output = command.output().expect("the program of the test can be started again");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success() && out.contains("1 passed"), "in a process of its own:\n{out}\n{err}");
    Some(out)
}

/// As [`in_subprocess`], on SwiftShader, a device without ray tracing. Prints a line and skips the test where
/// SwiftShader cannot be fetched.
///
/// # Panics
/// As [`in_subprocess`] and [`swiftshader`].
pub fn on_swiftshader(test: impl Fn(), body: impl FnOnce()) {
    let Some(icd) = swiftshader() else { return };
    in_subprocess(test, &only_driver(&icd), body);
}

/// Runs the program's tests, without those that are ignored or have one of `skipped` in their names, in a process
/// that has no device but SwiftShader, by ray queries and lowered pipelines in software. Prints a line and runs nothing where SwiftShader
/// cannot be fetched.
///
/// # Panics
/// When one of them fails, and as [`swiftshader`].
pub fn rerun_on_swiftshader(skipped: &[&str]) {
    let Some(icd) = swiftshader() else { return };
    let mut command = program(&only_driver(&icd));
    command.env("LVK_TEST_RAY_QUERY", "software").env("LVK_TEST_RAY_PIPELINE", "software");
    command.args(skipped.iter().flat_map(|name| ["--skip", name]));
    let status = command.status().expect("the program of the tests can be started again");
    assert!(status.success(), "tests fail on the device without ray tracing, see above");
}

/// As [`in_subprocess`], with no device but RADV's null device for an AMD chip of this `family`
/// (`RADV_FORCE_FAMILY`), which only compiles. Prints a line and skips the test where the driver cannot be fetched.
///
/// # Panics
/// As [`in_subprocess`] and [`radv`].
pub fn on_radv(test: impl Fn(), family: &str, body: impl FnOnce()) {
    let Some(icd) = radv() else { return };
    let mut variables = only_driver(&icd).to_vec();
    variables.push(("RADV_FORCE_FAMILY", Some(OsStr::new(family))));
    // A cached program would not be compiled again.
    variables.push(("MESA_SHADER_CACHE_DISABLE", Some(OsStr::new("true"))));
    in_subprocess(test, &variables, body);
}

/// Returns the path of a test within its program: modules and name, without the program's name.
pub fn test_path<T: Fn()>(_: &T) -> &'static str {
    let path = std::any::type_name::<T>();
    path.split_once("::").map_or(path, |(_, inside)| inside)
}

/// Returns a command that starts the test program again with `variables`, as for [`in_subprocess`].
fn program(variables: &[(&str, Option<&OsStr>)]) -> Command {
    let mut command = Command::new(std::env::current_exe().expect("the program of the test has a path"));
    for (name, value) in variables {
        match value {
            Some(value) => command.env(name, value),
            None => command.env_remove(name),
        };
    }
    command
}

fn only_driver(icd: &Path) -> [(&str, Option<&OsStr>); 4] {
    [
        ("VK_DRIVER_FILES", Some(icd.as_os_str())),
        ("VK_ICD_FILENAMES", None),
        ("LVK_DRIVER", None),
        ("LVK_DEVICE", None),
    ]
}
