//! The feature that a sample needs and the device lacks, as the sample's error names it.

use std::process::Command;

/// Runs `picture`, a command that writes an image. Returns the sample's error if the device has no mesh shaders. Other
/// errors are left to the tests.
pub fn mesh_shaders(mut picture: Command) -> Option<String> {
    let said = picture.output().map(|output| String::from_utf8_lossy(&output.stderr).into_owned());
    let said = said.unwrap_or_default();
    let lack = said.lines().find(|line| line.contains(" has no mesh shaders; "));
    lack.map(|line| line.trim_start_matches("error: ").to_owned())
}
