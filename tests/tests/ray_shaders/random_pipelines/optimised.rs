//! SPIR-V of random shaders, optimised by the program that `LVK_SPIRV_OPT` names.

use std::path::{Path, PathBuf};
use std::process::Command;

use lvk_tests::random::Random;

/// Passes of which each module gets some.
const PASSES: [&str; 34] = [
    "-O",
    "-O",
    "-Os",
    "--inline-entry-points-exhaustive",
    "--inline-entry-points-exhaustive",
    "--inline-entry-points-exhaustive",
    "--merge-return",
    "--merge-return",
    "--merge-blocks",
    "--cfg-cleanup",
    "--eliminate-dead-branches",
    "--eliminate-dead-branches",
    "--eliminate-dead-code-aggressive",
    "--ssa-rewrite",
    "--ssa-rewrite",
    "--simplify-instructions",
    "--if-conversion",
    "--convert-local-access-chains",
    "--combine-access-chains",
    "--scalar-replacement=100",
    "--private-to-local",
    "--copy-propagate-arrays",
    "--eliminate-local-single-block",
    "--eliminate-local-single-store",
    "--eliminate-insert-extract",
    "--redundancy-elimination",
    "--reduce-load-size",
    "--vector-dce",
    "--ccp",
    "--loop-unroll",
    "--loop-unswitch",
    "--loop-invariant-code-motion",
    "--loop-peeling",
    "--wrap-opkill",
];

/// The program, if the environment names one.
pub fn optimiser() -> Option<PathBuf> {
    std::env::var_os("LVK_SPIRV_OPT").filter(|name| !name.is_empty()).map(PathBuf::from)
}

/// Returns the words after passes that the number chooses, with the names of the passes. A module that the program refuses stays as it is.
pub fn optimised(program: &Path, number: u64, words: Vec<u32>) -> std::io::Result<(Vec<u32>, String)> {
    let mut random = Random::new(number);
    let count = 1 + random.bits() % 5;
    let passes: Vec<_> = (0..count).map(|_| PASSES[(random.bits() % PASSES.len() as u64) as usize]).collect();
    let folder = tempfile::tempdir()?;
    let [before, after] = ["before.spv", "after.spv"].map(|name| folder.path().join(name));
    std::fs::write(&before, bytemuck::cast_slice(&words))?;
    let done = Command::new(program)
        .args(["--target-env=vulkan1.3", "--scalar-block-layout"])
        .args(&passes)
        .args([before.as_os_str(), "-o".as_ref(), after.as_os_str()])
        .output()?;
    if !done.status.success() {
        return Ok((words, format!("{passes:?} failed: {}", String::from_utf8_lossy(&done.stderr))));
    }
    let bytes = std::fs::read(after)?;
    Ok((bytemuck::pod_collect_to_vec(&bytes), format!("{passes:?}")))
}
