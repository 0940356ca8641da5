//! The log that the layer writes: calls, the fault, and live objects.

use std::collections::{BTreeMap, BTreeSet};

use crate::fault::FaultError;
use crate::leftovers::Leftovers;

/// A call of a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Call {
    /// Name of the command.
    pub command: String,
    /// Errors that the command may answer, in a run without a fault.
    pub errors: Vec<FaultError>,
    /// True if the layer has made the call fail.
    pub fails: bool,
}

/// Content of a log.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CallLog {
    /// The calls, in order.
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
    pub live: BTreeMap<String, usize>,
    /// Objects that were alive when their device or instance was destroyed, by type.
    pub orphans: BTreeMap<String, usize>,
    /// Devices and instances that were destroyed before their objects.
    pub orphaning: usize,
    /// Types of objects that were destroyed though they were not alive.
    pub dead: BTreeSet<String>,
    /// Commands that used a command buffer which an earlier call had not begun or reset, because it had failed.
    pub unready: BTreeSet<String>,
    /// Objects that were given names.
    pub names: BTreeSet<NamedObject>,
    /// Names of physical devices, likewise.
    pub devices: BTreeSet<String>,
    /// What the process held at its end.
    pub leftovers: Option<Leftovers>,
}

/// An object that was given a name.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct NamedObject {
    /// Kind, as `ash` writes a `VkObjectType`: `BUFFER`.
    pub kind: String,
    /// Name, as errors show it.
    pub name: String,
}

impl NamedObject {
    fn parse(text: &str) -> Option<Self> {
        let (kind, name) = text.split_once(' ')?;
        Some(Self { kind: kind.to_owned(), name: name.to_owned() })
    }
}

impl CallLog {
    /// Reads a log. Lines of another form are ignored, as a killed process leaves a part of a line.
    #[must_use]
    pub fn parse(text: &str) -> Self {
        let mut log = Self::default();
        for line in text.lines() {
            // A name may have several spaces.
            if let Some(object) = line.strip_prefix("name ") {
                log.names.extend(NamedObject::parse(object));
                continue;
            }
            if let Some(name) = line.strip_prefix("device ") {
                log.devices.insert(name.to_owned());
                continue;
            }
            let mut words = line.split_whitespace();
            match words.next() {
                Some("call") => log.calls.extend(words.next().map(|command| Call {
                    command: command.to_owned(),
                    errors: words.filter_map(FaultError::named).collect(),
                    fails: false,
                })),
                Some("fails") => {
                    if let Some(command) = words.next().map(str::to_owned) {
                        log.failed.insert(command.clone());
                        log.calls.push(Call { command, errors: Vec::new(), fails: true });
                    }
                }
                Some("fault") => log.reached = true,
                Some("dead") => log.dead.extend(words.next().map(str::to_owned)),
                Some("unready") => log.unready.extend(words.next().map(str::to_owned)),
                Some("left") => log.leftovers = Leftovers::parse(words),
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

fn live_count(word: &str) -> Option<(String, usize)> {
    let (kind, count) = word.split_once('=')?;
    Some((kind.to_owned(), count.parse().ok()?))
}

/// Returns the line for a call.
pub(crate) fn call_line(command: &str, errors: &[FaultError]) -> String {
    errors.iter().fold(format!("call {command}"), |line, error| format!("{line} {}", error.name()))
}

/// Returns the line that says that the call of the fault was reached.
pub(crate) fn fault_line(command: &str) -> String {
    format!("fault {command}")
}

/// Returns the line for a call that is made to fail.
pub(crate) fn fails_line(command: &str) -> String {
    format!("fails {command}")
}

/// Returns the line for the name of an object.
pub(crate) fn name_line(object: &NamedObject) -> String {
    format!("name {} {}", object.kind, object.name)
}

/// Returns the line for the name of a physical device.
pub(crate) fn device_line(name: &str) -> String {
    format!("device {name}")
}

/// Returns the line for a call on a lost device, by another thread than that of the fault.
pub(crate) fn told_line(command: &str) -> String {
    format!("told {command}")
}

/// Returns the line for the live objects, at the creation and at the end of an instance.
pub(crate) fn live_line(live: &BTreeMap<&'static str, usize>) -> String {
    counts_line("live", live)
}

/// Returns the line for an object that is destroyed though it is not alive.
pub(crate) fn dead_line(kind: &str) -> String {
    format!("dead {kind}")
}

/// Returns the line for a command that uses a command buffer which is not ready.
pub(crate) fn unready_line(command: &str) -> String {
    format!("unready {command}")
}

/// Returns the line for what a process holds at its end.
#[must_use]
pub fn left_line(leftovers: &Leftovers) -> String {
    format!("left {leftovers}")
}

/// Returns the line for objects of a device or instance that is destroyed before them.
pub(crate) fn orphans_line(orphans: &BTreeMap<&'static str, usize>) -> String {
    counts_line("orphans", orphans)
}

fn counts_line(word: &str, objects: &BTreeMap<&'static str, usize>) -> String {
    let counts = objects.iter().filter(|(_, count)| **count != 0);
    counts.fold(word.to_owned(), |line, (kind, count)| format!("{line} {kind}={count}"))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Returns the calls of a text, as in `vkCreateBuffer! vkCreateBuffer`, where the first fails.
    pub(crate) fn calls(text: &str) -> Vec<Call> {
        let call = |word: &str| Call {
            command: word.trim_end_matches('!').to_owned(),
            errors: Vec::new(),
            fails: word.ends_with('!'),
        };
        text.split_whitespace().map(call).collect()
    }

    #[test]
    fn lines_come_back_and_the_last_live_objects_count() {
        let errors = [FaultError::HostMemory, FaultError::DeviceLost];
        let left = Leftovers { file_descriptors: 9, threads: 2, heap_bytes: 1234 };
        let map = NamedObject { kind: "IMAGE".to_owned(), name: "height map,  rough".to_owned() };
        let text = [
            call_line("vkQueueSubmit2", &errors),
            live_line(&BTreeMap::from([("VkInstance", 1)])),
            fault_line("vkCreateBuffer"),
            fails_line("vkCreateBuffer"),
            told_line("vkWaitSemaphores"),
            told_line("vkWaitSemaphores"),
            fails_line("vkWaitSemaphores"),
            fails_line("vkWaitSemaphores"),
            name_line(&map),
            device_line("NVIDIA  H200"),
            live_line(&BTreeMap::from([("VkInstance", 0), ("VkBuffer", 2)])),
            orphans_line(&BTreeMap::from([("VkFence", 1)])),
            orphans_line(&BTreeMap::from([("VkFence", 2), ("VkImage", 1)])),
            dead_line("VkQueryPool"),
            unready_line("vkEndCommandBuffer"),
            left_line(&left),
            "ca".to_owned(),
        ];
        let mut calls = calls("vkQueueSubmit2 vkCreateBuffer! vkWaitSemaphores! vkWaitSemaphores!");
        calls[0].errors = errors.to_vec();
        let expected = CallLog {
            calls,
            unready: BTreeSet::from(["vkEndCommandBuffer".to_owned()]),
            names: BTreeSet::from([map.clone()]),
            devices: BTreeSet::from(["NVIDIA  H200".to_owned()]),
            reached: true,
            failed: ["vkCreateBuffer", "vkWaitSemaphores"].map(str::to_owned).into(),
            told_others: BTreeSet::from(["vkWaitSemaphores".to_owned()]),
            counts_objects: true,
            live: BTreeMap::from([("VkBuffer".to_owned(), 2)]),
            orphans: BTreeMap::from([("VkFence".to_owned(), 3), ("VkImage".to_owned(), 1)]),
            orphaning: 2,
            dead: BTreeSet::from(["VkQueryPool".to_owned()]),
            leftovers: Some(left.clone()),
        };
        assert_eq!(CallLog::parse(&text.join("\n")), expected);
        assert_eq!(CallLog::parse(""), CallLog::default());
    }
}
