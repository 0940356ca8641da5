//! Every target over its corpus, and over mutations of it.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};

use lvk_fuzz::mutation::{Random, mutated};
use lvk_fuzz::{Cost, TARGETS, Target};

/// Mutations of each target.
const MUTATIONS: u64 = 3_000;
/// Longest mutated input in bytes.
const MAX_BYTES: usize = 16 << 10;

fn corpus_folder(target: &Target) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target.name)
}

/// Returns the committed inputs of a target, in the order of their names.
fn corpus(target: &Target) -> Vec<Vec<u8>> {
    let folder = corpus_folder(target);
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

/// Runs an input. If it fails, the message has its bytes.
fn run(target: &Target, bytes: &[u8]) -> Cost {
    let result = std::panic::catch_unwind(|| target.run(bytes));
    result.unwrap_or_else(|_| panic!("target '{}' failed on '{}'", target.name, bytes.escape_ascii()))
}

#[test]
fn the_corpus_is_small_and_read_within_the_bounds() {
    for target in TARGETS {
        let inputs = corpus(target);
        assert!(!inputs.is_empty(), "no inputs of '{}'", target.name);
        let total: usize = inputs.iter().map(Vec::len).sum();
        assert!(total <= 128 << 10, "the corpus of '{}' has {total} bytes", target.name);
        let accepted = inputs.iter().filter(|bytes| run(target, bytes).is_accepted).count();
        println!("{}: {accepted} of {} inputs are accepted", target.name, inputs.len());
        assert!(accepted > 0, "'{}' refuses every input, so mutations do not get far", target.name);
    }
}

/// A header or a checksum that has changed would keep every mutation of such a file out.
#[test]
fn whole_files_are_accepted() {
    for name in ["blas", "pipeline_cache", "shader_cache", "tree"] {
        let target = Target::find(name).unwrap();
        let bytes = std::fs::read(corpus_folder(target).join("whole-file")).unwrap();
        assert!(run(target, &bytes).is_accepted, "{name}");
    }
}

#[test]
fn mutations_are_read_within_the_bounds() {
    for target in TARGETS {
        let inputs = corpus(target);
        let mut random = Random::new(27);
        let (mut most, mut share) = (0, 0);
        for _ in 0..MUTATIONS {
            let [first, second] = [(); 2].map(|()| &inputs[random.below(inputs.len())]);
            let mut bytes = mutated(first, second, &mut random);
            bytes.truncate(MAX_BYTES);
            let cost = run(target, &bytes);
            most = most.max(cost.bytes);
            share = share.max(100 * cost.bytes / cost.most);
        }
        println!(
            "{}: {MUTATIONS} mutations, {most} bytes at most, {share} % of a bound at most",
            target.name
        );
    }
}
