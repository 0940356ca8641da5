//! Runs a test in a process of its own, because environment variables count once for each process.
#![expect(clippy::expect_used, reason = "a test whose process cannot be started has failed")]

use std::ffi::OsStr;
use std::path::Path;
use std::process::Command;

use crate::device::{radv, swiftshader};

const MARK: &str = "LVK_TEST_CHILD";

/// Runs `body` in a new process with `variables` set, or taken away where there is no value.
///
/// `test` is the calling test itself: the new process runs it alone, which calls this function again and gets to `body`.
///
/// # Panics
/// When the process fails, with what it wrote.
pub fn in_subprocess(test: impl Fn(), variables: &[(&str, Option<&OsStr>)], body: impl FnOnce()) {
    output_of_subprocess(test, variables, body);
}

/// As [`in_subprocess`]; answers what the new process wrote to standard output, and in that process nothing.
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

/// As [`in_subprocess`], on the device without ray tracing; skipped loudly where that cannot be had.
///
/// # Panics
/// As [`in_subprocess`] and [`swiftshader`].
pub fn on_swiftshader(test: impl Fn(), body: impl FnOnce()) {
    let Some(icd) = swiftshader() else { return };
    in_subprocess(test, &only_driver(&icd), body);
}

/// Runs the program's tests, but for those that are ignored or have one of `skipped` in their names, in a process that has no
/// device but the one without ray tracing, by ray queries in software; skipped loudly where that cannot be had.
///
/// # Panics
/// When one of them fails, and as [`swiftshader`].
pub fn rerun_on_swiftshader(skipped: &[&str]) {
    let Some(icd) = swiftshader() else { return };
    let mut command = program(&only_driver(&icd));
    command.env("LVK_TEST_RAY_QUERY", "software");
    command.args(skipped.iter().flat_map(|name| ["--skip", name]));
    let status = command.status().expect("the program of the tests can be started again");
    assert!(status.success(), "tests fail on the device without ray tracing, see above");
}

/// As [`in_subprocess`], with no device but an AMD chip of this `family` (`RADV_FORCE_FAMILY`), which compiles and does nothing
/// else; skipped loudly where its driver cannot be had.
///
/// # Panics
/// As [`in_subprocess`] and [`radv`].
pub fn on_radv(test: impl Fn(), family: &str, body: impl FnOnce()) {
    let Some(icd) = radv() else { return };
    let mut variables = only_driver(&icd).to_vec();
    variables.push(("RADV_FORCE_FAMILY", Some(OsStr::new(family))));
    // What was compiled before is to be compiled again.
    variables.push(("MESA_SHADER_CACHE_DISABLE", Some(OsStr::new("true"))));
    in_subprocess(test, &variables, body);
}

/// The path by which the program of a test runs it alone: its modules and its name, without the program's.
pub fn test_path<T: Fn()>(_: &T) -> &'static str {
    let path = std::any::type_name::<T>();
    path.split_once("::").map_or(path, |(_, inside)| inside)
}

/// The program of the tests, to be started again with `variables` as [`in_subprocess`] takes them.
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
