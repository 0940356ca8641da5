//! The verdict on one run: decided from plain values.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use crate::fault::{Fault, FaultError};

/// The end of a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The process has ended with this status.
    Status(i32),
    /// A signal has ended the process.
    Signal(i32),
    /// The process did not end in time.
    Hang,
}

/// Observations of one run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunOutcome {
    /// The end of the process.
    pub ending: Ending,
    /// Standard error of the process.
    pub stderr: String,
    /// True if the fault was reached.
    pub reached: bool,
    /// Commands that told other threads of the loss of a device.
    pub told_others: BTreeSet<String>,
    /// Live objects at the end, by type.
    pub live: BTreeMap<String, i64>,
    /// The result of the first try, a picture or values. `None` if it was not written.
    pub result: Option<Vec<u8>>,
    /// The result of the second try, in the same process after the first has failed.
    pub second_result: Option<Vec<u8>>,
    /// Names of files beside the results, and in the caches.
    pub files: BTreeSet<String>,
}

/// A defect of a run.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Flaw {
    /// The process did not end in time.
    Hang,
    /// A signal has ended the process.
    Signal(i32),
    /// The text of a panic.
    Panic,
    /// A status other than 0 and 1.
    Status(i32),
    /// Objects that were not destroyed.
    Leak(String),
    /// Files that a run without fault does not leave.
    Litter(String),
    /// Success with another result.
    WrongResult,
    /// Failure that leaves an incomplete result.
    PartialResult,
    /// Failure without one line that tells the error.
    NoMessage,
    /// An error that does not name the command that has failed.
    UnnamedCommand(String),
    /// An error that does not name the object of that command in quotes.
    UnnamedObject(String),
    /// No result of a second try in the same process, or another.
    NotRecovered,
}

impl fmt::Display for Flaw {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Hang => out.write_str("hang"),
            Self::Signal(signal) => write!(out, "ended by signal {signal}"),
            Self::Panic => out.write_str("panic"),
            Self::Status(status) => write!(out, "status {status}"),
            Self::Leak(objects) => write!(out, "leak of {objects}"),
            Self::Litter(files) => write!(out, "left files {files}"),
            Self::WrongResult => out.write_str("wrong result"),
            Self::PartialResult => out.write_str("partial result"),
            Self::NoMessage => out.write_str("no message, or several"),
            Self::UnnamedCommand(message) => write!(out, "the command is not named: {message}"),
            Self::UnnamedObject(message) => write!(out, "the object is not named: {message}"),
            Self::NotRecovered => out.write_str("a second try in the same process fails"),
        }
    }
}

/// Judges a run with `fault` by a run without.
#[must_use]
pub fn flaws(fault: Option<&Fault>, found: &RunOutcome, clean: &RunOutcome) -> Vec<Flaw> {
    let mut flaws = Vec::new();
    match found.ending {
        Ending::Hang => flaws.push(Flaw::Hang),
        Ending::Signal(signal) => flaws.push(Flaw::Signal(signal)),
        Ending::Status(status @ (0 | 1)) => judge_result(fault, found, clean, status == 0, &mut flaws),
        Ending::Status(status) => flaws.push(Flaw::Status(status)),
    }
    if found.stderr.contains("panicked at") {
        flaws.push(Flaw::Panic);
    }
    let live: Vec<_> = found.live.iter().filter(|(_, count)| **count != 0).collect();
    if !live.is_empty() {
        let texts: Vec<_> = live.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
        flaws.push(Flaw::Leak(texts.join(", ")));
    }
    // A fallback may compile other shaders, whose cache files are complete.
    let fell_back = found.ending == Ending::Status(0);
    let is_litter = |name: &&String| !(fell_back && name.starts_with("caches/") && !name.ends_with(".tmp"));
    let litter: Vec<_> = found.files.difference(&clean.files).filter(is_litter).cloned().collect();
    if !litter.is_empty() {
        flaws.push(Flaw::Litter(litter.join(", ")));
    }
    flaws
}

fn judge_result(
    fault: Option<&Fault>,
    found: &RunOutcome,
    clean: &RunOutcome,
    succeeded: bool,
    flaws: &mut Vec<Flaw>,
) {
    if succeeded {
        if found.result.is_none() || found.result != clean.result {
            flaws.push(Flaw::WrongResult);
        }
        return;
    }
    if found.result.is_some() && found.result != clean.result {
        flaws.push(Flaw::PartialResult);
    }
    let errors: Vec<&str> = found.stderr.lines().filter(|line| line.starts_with("error: ")).collect();
    match *errors {
        [error] => {
            // A device is lost for all threads, and the first that notices it makes the report.
            let names_other = found.told_others.iter().any(|command| error.contains(command));
            if fault.is_some_and(|fault| !names_other && !names_cause(error, fault)) {
                flaws.push(Flaw::UnnamedCommand(error.to_owned()));
            } else if !names_object(error) {
                flaws.push(Flaw::UnnamedObject(error.to_owned()));
            }
        }
        _ => flaws.push(Flaw::NoMessage),
    }
    // A fault that stays hinders the second try, too.
    let tries_again = fault.is_some_and(|fault| !fault.stays);
    if tries_again && (found.second_result.is_none() || found.second_result != clean.result) {
        flaws.push(Flaw::NotRecovered);
    }
}

/// True if the error names the command that failed, or the object whose window is gone. A fault that stays may be met
/// by another command first, where the library goes on without the one that failed.
fn names_cause(error: &str, fault: &Fault) -> bool {
    let names = |command: &str| error.contains(command);
    names(&fault.command)
        || fault.stays && names_a_command(error)
        || fault.error == FaultError::SurfaceLost && error.contains(WINDOW_IS_GONE)
        // The loader calls it while it creates a device.
        || fault.command == "vkEnumerateDeviceExtensionProperties" && names("vkCreateDevice")
        // Its result is that of the command that was deferred.
        || fault.command == "vkGetDeferredOperationResultKHR" && names("vkCreateRayTracingPipelinesKHR")
}

/// True if a word of the text is a Vulkan command, such as `vkMapMemory`.
fn names_a_command(text: &str) -> bool {
    texts_after_commands(text).next().is_some()
}

/// True if the error names the object of a command, as in `vkCreateBuffer for 'rain'` and `vkCreateBuffer failed for 'rain'`.
///
/// Two other forms count: the swapchain whose window is gone, and what needs ray tracing on a device that was created
/// without. Every command concerns an object, those before the device the loader, the instance or the window.
fn names_object(error: &str) -> bool {
    let is_named = |rest: &str| {
        let rest = rest.strip_prefix(" failed").unwrap_or(rest);
        rest.strip_prefix(" for '").is_some_and(|name| !name.starts_with('\''))
    };
    texts_after_commands(error).any(is_named)
        || error
            .split_once(WINDOW_IS_GONE)
            .is_some_and(|(before, _)| before.contains(" '") && !before.ends_with('\''))
        || error.split_once(WITHOUT_RAY_TRACING).is_some_and(|(before, _)| before.contains(" '"))
}

/// A part of errors about ray tracing behind the quoted name of what needs it, on a device that was created without.
const WITHOUT_RAY_TRACING: &str = "vkCreateDevice with ray tracing returned";

/// The end of an error about a lost surface, after the quoted name of the swapchain.
const WINDOW_IS_GONE: &str = "': its window is gone";

/// Returns the text behind each Vulkan command.
fn texts_after_commands(text: &str) -> impl Iterator<Item = &str> {
    let is_of_word = |letter: char| letter.is_ascii_alphanumeric();
    text.match_indices("vk").filter_map(move |(start, _)| {
        let (before, word) = text.split_at(start);
        let is_command = word[2..].starts_with(|letter: char| letter.is_ascii_uppercase());
        (is_command && !before.ends_with(is_of_word)).then(|| word.trim_start_matches(is_of_word))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clean() -> RunOutcome {
        RunOutcome {
            ending: Ending::Status(0),
            stderr: String::new(),
            reached: false,
            told_others: BTreeSet::new(),
            live: BTreeMap::new(),
            result: Some(b"picture".to_vec()),
            second_result: None,
            files: BTreeSet::from(["caches/pipelines".to_owned()]),
        }
    }

    fn refused() -> RunOutcome {
        RunOutcome {
            ending: Ending::Status(1),
            stderr: "warning: x\nerror: out of host memory in vkCreateBuffer for 'rain'\n".to_owned(),
            reached: true,
            result: None,
            second_result: clean().result,
            ..clean()
        }
    }

    fn fault(stays: bool) -> Fault {
        Fault { command: "vkCreateBuffer".into(), call: 1, error: FaultError::HostMemory, stays }
    }

    fn found(outcome: &RunOutcome) -> Vec<Flaw> {
        flaws(Some(&fault(false)), outcome, &clean())
    }

    #[test]
    fn the_right_result_and_a_polite_refusal_pass() {
        let other_shader = RunOutcome { files: BTreeSet::from(["caches/3.spirv".to_owned()]), ..clean() };
        let told_others = BTreeSet::from(["vkWaitSemaphores".to_owned()]);
        let stderr = "error: the device was lost in vkWaitSemaphores for 'rain'".to_owned();
        let by_other_thread = RunOutcome { told_others, stderr, ..refused() };
        for outcome in [clean(), refused(), other_shader, by_other_thread] {
            assert_eq!(found(&outcome), []);
        }
        let twice = RunOutcome { second_result: None, stderr: refused().stderr.repeat(2), ..refused() };
        assert_eq!(flaws(Some(&fault(true)), &twice, &clean()), [Flaw::NoMessage], "one try, one error");
        assert_eq!(found(&twice), [Flaw::NoMessage, Flaw::NotRecovered]);
    }

    #[test]
    fn commands_may_have_the_name_of_their_caller() {
        let names = |command: &str, error, text| {
            names_cause(text, &Fault { command: command.into(), error, ..fault(false) })
        };
        let memory = FaultError::HostMemory;
        assert!(names("vkEnumerateDeviceExtensionProperties", memory, "error: vkCreateDevice failed"));
        let deferred = "error: out of host memory in vkCreateRayTracingPipelinesKHR for 'rays'";
        assert!(names("vkGetDeferredOperationResultKHR", memory, deferred));
        assert!(names(
            "vkQueuePresentKHR",
            FaultError::SurfaceLost,
            "error: swapchain 'main': its window is gone"
        ));
        assert!(!names("vkQueuePresentKHR", memory, "error: swapchain 'main': its window is gone"));
        assert!(!names("vkCreateBuffer", memory, "error: vkCreateDevice failed"));
        let later = |text| names_cause(text, &fault(true));
        assert!(later("error: vkCreateDevice failed") && !later("error: lvk_faults failed"));
    }

    #[test]
    fn objects_are_quoted_behind_the_command_or_lose_their_window() {
        for named in [
            "error: out of host memory in vkMapMemory for 'rain'",
            "error: rain: vkMapMemory failed for 'rain': unknown",
            "error: no device (vkGetPhysicalDeviceSurfaceSupportKHR failed for 'window': lost)",
            "error: swapchain 'main': its window is gone; resume it",
            "error: shader 'a' needs ray queries: vkCreateDevice with ray tracing returned: lost",
        ] {
            assert!(names_object(named), "{named}");
        }
        for unnamed in [
            "error: out of host memory in vkMapMemory",
            "error: out of host memory in vkMapMemory for ''",
            "error: the device was lost in vkQueueSubmit2; the graphics queue had not finished submission 3 'frame'",
            "error: 'rain': vkMapMemory failed: unknown",
            "error: lvkMapMemory for 'rain'",
            "error: swapchain '': its window is gone; resume it",
            "error: no ray queries: vkCreateDevice with ray tracing returned 'lost'",
        ] {
            assert!(!names_object(unnamed), "{unnamed}");
        }
    }

    #[test]
    fn every_flaw_is_caught() {
        let unnamed = "error: out of memory".to_owned();
        let without_object = "error: out of host memory in vkCreateBuffer".to_owned();
        let cases = [
            (RunOutcome { ending: Ending::Hang, ..refused() }, Flaw::Hang),
            (RunOutcome { ending: Ending::Signal(11), ..refused() }, Flaw::Signal(11)),
            (RunOutcome { ending: Ending::Status(2), ..refused() }, Flaw::Status(2)),
            (
                RunOutcome {
                    stderr: refused().stderr + "thread 'main' panicked at src/a.rs:1:2:\n",
                    ..refused()
                },
                Flaw::Panic,
            ),
            (
                RunOutcome { live: BTreeMap::from([("VkBuffer".to_owned(), 2)]), ..clean() },
                Flaw::Leak("2 VkBuffer".into()),
            ),
            (
                RunOutcome { files: BTreeSet::from([".lvk-1.partial".to_owned()]), ..clean() },
                Flaw::Litter(".lvk-1.partial".into()),
            ),
            (
                RunOutcome { files: BTreeSet::from(["caches/1-2.tmp".to_owned()]), ..clean() },
                Flaw::Litter("caches/1-2.tmp".into()),
            ),
            (
                RunOutcome { files: BTreeSet::from(["caches/3.spirv".to_owned()]), ..refused() },
                Flaw::Litter("caches/3.spirv".into()),
            ),
            (RunOutcome { result: Some(b"pic".to_vec()), ..clean() }, Flaw::WrongResult),
            (RunOutcome { result: None, ..clean() }, Flaw::WrongResult),
            (RunOutcome { result: Some(b"pic".to_vec()), ..refused() }, Flaw::PartialResult),
            (RunOutcome { stderr: String::new(), ..refused() }, Flaw::NoMessage),
            (RunOutcome { stderr: unnamed.clone(), ..refused() }, Flaw::UnnamedCommand(unnamed)),
            (RunOutcome { stderr: without_object.clone(), ..refused() }, Flaw::UnnamedObject(without_object)),
            (RunOutcome { second_result: None, ..refused() }, Flaw::NotRecovered),
            (RunOutcome { second_result: Some(b"pic".to_vec()), ..refused() }, Flaw::NotRecovered),
        ];
        for (outcome, flaw) in cases {
            assert_eq!(found(&outcome), [flaw]);
        }
    }
}
