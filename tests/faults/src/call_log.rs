//! The log that the layer writes: calls, the fault, and live objects.

use std::collections::{BTreeMap, BTreeSet};

use crate::fault::FaultError;

/// A call of a run without fault.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Call {
    /// Name of the command.
    pub command: String,
    /// Errors that the command may answer.
    pub errors: Vec<FaultError>,
}

/// Content of a log.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CallLog {
    /// The calls, of a run without fault only.
    pub calls: Vec<Call>,
    /// True if the call that was to fail was reached.
    pub reached: bool,
    /// Commands of which a call was made to fail.
    pub failed: BTreeSet<String>,
    /// Commands that told other threads of the loss of a device, which these may report first.
    pub told_others: BTreeSet<String>,
    /// True if an instance was created or destroyed.
    pub counts_objects: bool,
    /// Objects that were alive at the end, by type. An instance among them says that others may be, too.
    pub live: BTreeMap<String, i64>,
    /// Objects that were alive when their device or instance was destroyed, by type.
    pub orphans: BTreeMap<String, i64>,
    /// Devices and instances that were destroyed before their objects.
    pub orphaning: i64,
}

impl CallLog {
    /// Reads a log. Lines of another form are ignored, as a killed process leaves a part of a line.
    #[must_use]
    pub fn parse(text: &str) -> Self {
        let mut log = Self::default();
        for line in text.lines() {
            let mut words = line.split_whitespace();
            match words.next() {
                Some("call") => log.calls.extend(words.next().map(|command| Call {
                    command: command.to_owned(),
                    errors: words.filter_map(FaultError::named).collect(),
                })),
                Some("fault") => log.reached = true,
                Some("failed") => log.failed.extend(words.next().map(str::to_owned)),
                Some("told") => log.told_others.extend(words.next().map(str::to_owned)),
                Some("live") => {
                    log.counts_objects = true;
                    log.live = words.filter_map(live_count).collect();
                }
                Some("orphans") => {
                    log.orphaning += 1;
                    for (kind, count) in words.filter_map(live_count) {
                        *log.orphans.entry(kind).or_default() += count;
                    }
                }
                _ => {}
            }
        }
        log
    }
}

fn live_count(word: &str) -> Option<(String, i64)> {
    let (kind, count) = word.split_once('=')?;
    Some((kind.to_owned(), count.parse().ok()?))
}

/// Returns the line for a call.
pub(crate) fn call_line(command: &str, errors: &[FaultError]) -> String {
    errors.iter().fold(format!("call {command}"), |line, error| format!("{line} {}", error.name()))
}

/// Returns the line for the call that fails.
pub(crate) fn fault_line(command: &str) -> String {
    format!("fault {command}")
}

/// Returns the line for a command of which a call fails for the first time.
pub(crate) fn failed_line(command: &str) -> String {
    format!("failed {command}")
}

/// Returns the line for a call on a lost device, by another thread than that of the fault.
pub(crate) fn told_line(command: &str) -> String {
    format!("told {command}")
}

/// Returns the line for the live objects, at the creation and at the end of an instance.
pub(crate) fn live_line(live: &BTreeMap<&'static str, i64>) -> String {
    counts_line("live", live)
}

/// Returns the line for objects of a device or instance that is destroyed before them.
pub(crate) fn orphans_line(orphans: &BTreeMap<&'static str, i64>) -> String {
    counts_line("orphans", orphans)
}

fn counts_line(word: &str, objects: &BTreeMap<&'static str, i64>) -> String {
    let counts = objects.iter().filter(|(_, count)| **count != 0);
    counts.fold(word.to_owned(), |line, (kind, count)| format!("{line} {kind}={count}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_come_back_and_the_last_live_objects_count() {
        let errors = [FaultError::HostMemory, FaultError::DeviceLost];
        let text = [
            call_line("vkQueueSubmit2", &errors),
            live_line(&BTreeMap::from([("VkInstance", 1)])),
            fault_line("vkCreateBuffer"),
            failed_line("vkCreateBuffer"),
            told_line("vkWaitSemaphores"),
            told_line("vkWaitSemaphores"),
            failed_line("vkWaitSemaphores"),
            live_line(&BTreeMap::from([("VkInstance", 0), ("VkBuffer", 2)])),
            orphans_line(&BTreeMap::from([("VkFence", 1)])),
            orphans_line(&BTreeMap::from([("VkFence", 2), ("VkImage", -1)])),
            "ca".to_owned(),
        ];
        let expected = CallLog {
            calls: vec![Call { command: "vkQueueSubmit2".into(), errors: errors.to_vec() }],
            reached: true,
            failed: ["vkCreateBuffer", "vkWaitSemaphores"].map(str::to_owned).into(),
            told_others: BTreeSet::from(["vkWaitSemaphores".to_owned()]),
            counts_objects: true,
            live: BTreeMap::from([("VkBuffer".to_owned(), 2)]),
            orphans: BTreeMap::from([("VkFence".to_owned(), 3), ("VkImage".to_owned(), -1)]),
            orphaning: 2,
        };
        assert_eq!(CallLog::parse(&text.join("\n")), expected);
        assert_eq!(CallLog::parse(""), CallLog::default());
    }
}
