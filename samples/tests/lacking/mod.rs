//! What the device lacks of what a sample is about, as the sample itself says it.

use std::process::Command;

/// Why the sample cannot show anything, where that is because the device has no mesh shaders: `picture` writes one. Whatever
/// else is wrong is left to the tests.
pub fn mesh_shaders(mut picture: Command) -> Option<String> {
    let said = picture.output().map(|output| String::from_utf8_lossy(&output.stderr).into_owned());
    let said = said.unwrap_or_default();
    let lack = said.lines().find(|line| line.contains(" has no mesh shaders; "));
    lack.map(|line| line.trim_start_matches("error: ").to_owned())
}
