//! SPIR-V of random shaders, optimised by the program that `LVK_SPIRV_OPT` names.

use std::path::{Path, PathBuf};
use std::process::Command;

use lvk_tests::random::Random;

/// Passes like those of `-O`, which would take unused members out of payloads on one side of a trace.
const ALL: [&str; 24] = [
    "--eliminate-dead-branches",
    "--merge-return",
    "--inline-entry-points-exhaustive",
    "--eliminate-dead-functions",
    "--private-to-local",
    "--eliminate-local-single-block",
    "--eliminate-local-single-store",
    "--eliminate-dead-code-aggressive",
    "--scalar-replacement=100",
    "--convert-local-access-chains",
    "--eliminate-local-single-block",
    "--ssa-rewrite",
    "--eliminate-dead-code-aggressive",
    "--ccp",
    "--eliminate-dead-branches",
    "--redundancy-elimination",
    "--combine-access-chains",
    "--simplify-instructions",
    "--vector-dce",
    "--if-conversion",
    "--copy-propagate-arrays",
    "--reduce-load-size",
    "--merge-blocks",
    "--simplify-instructions",
];

/// Passes of which each other module gets some. `--loop-invariant-code-motion` is not among them: that of SPIRV-Tools 2023.1 moves loads in
/// front of loops that store.
const PASSES: [&str; 30] = [
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
    "--loop-peeling",
    "--wrap-opkill",
];

/// The program, if the environment names one.
pub fn optimiser() -> Option<PathBuf> {
    std::env::var_os("LVK_SPIRV_OPT").filter(|name| !name.is_empty()).map(PathBuf::from)
}

/// Returns the words after passes that the number chooses, with the names of the passes. A module that the program refuses, or makes
/// invalid, stays as it is: SPIRV-Tools 2023.1 puts functions that return early in place in continue constructs.
pub fn optimised(program: &Path, number: u64, words: Vec<u32>) -> std::io::Result<(Vec<u32>, String)> {
    let mut random = Random::new(number);
    let count = 1 + random.bits() % 5;
    let mut passes: Vec<_> =
        (0..count).map(|_| PASSES[(random.bits() % PASSES.len() as u64) as usize]).collect();
    if random.bits().is_multiple_of(3) {
        passes = ALL.to_vec();
    }
    let folder = tempfile::tempdir()?;
    let [before, after] = ["before.spv", "after.spv"].map(|name| folder.path().join(name));
    std::fs::write(&before, bytemuck::cast_slice(&words))?;
    let done = Command::new(program)
        .args(["--target-env=vulkan1.3", "--scalar-block-layout", "--validate-after-all"])
        .args(&passes)
        .args([before.as_os_str(), "-o".as_ref(), after.as_os_str()])
        .output()?;
    if !done.status.success() {
        return Ok((words, format!("{passes:?} failed: {}", String::from_utf8_lossy(&done.stderr))));
    }
    let bytes = std::fs::read(after)?;
    Ok((bytemuck::pod_collect_to_vec(&bytes), format!("{passes:?}")))
}
