//! The watchdog ends a process whose read does not end.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::process::{Command, Stdio};

use lvk_fuzz::{MOST_SECONDS_VARIABLE, MemoryBound, Target};

/// The variable that has this program read without an end, as the child of its own test.
const ENDLESS_VARIABLE: &str = "LVK_FUZZ_ENDLESS";

/// A reader that loops for ever.
fn endless(_: &[u8]) -> bool {
    loop {
        std::hint::spin_loop();
    }
}

/// A reader that waits for ever.
fn waiting(_: &[u8]) -> bool {
    loop {
        std::thread::park();
    }
}

#[test]
fn reads_without_an_end_end_the_process_and_keep_the_input() {
    if let Ok(kind) = std::env::var(ENDLESS_VARIABLE) {
        let read = if kind == "loop" { endless } else { waiting };
        let memory = MemoryBound { fixed: 0, per_byte: 0, per_decoded: 0, most: usize::MAX };
        _ = Target { name: "endless", memory, decoded: |_| 0, read }.run(b"an\0input");
        return;
    }
    // The read that waits takes ten times as long.
    let children = ["loop", "wait"].map(|kind| {
        let folder = tempfile::tempdir().unwrap();
        let child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "reads_without_an_end_end_the_process_and_keep_the_input"])
            .envs([(ENDLESS_VARIABLE, kind), (MOST_SECONDS_VARIABLE, "1")])
            .envs(["TMPDIR", "TMP", "TEMP"].map(|variable| (variable, folder.path())))
            .stderr(Stdio::piped())
            .stdout(Stdio::null())
            .spawn();
        (folder, child.unwrap())
    });
    for (folder, child) in children {
        let ended = child.wait_with_output().unwrap();
        let text = String::from_utf8_lossy(&ended.stderr);
        assert!(!ended.status.success(), "{text}");
        assert!(text.contains(r"target 'endless' does not end on 'an\x00input'; it is kept as "), "{text}");
        let kept: Vec<_> =
            std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path()).collect();
        assert_eq!(kept.len(), 1, "{kept:?}");
        assert_eq!(std::fs::read(&kept[0]).unwrap(), b"an\0input");
    }
}
