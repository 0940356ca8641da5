//! The verdict on one run: decided from plain values.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use crate::fault::{Fault, FaultError, Span};
use crate::leftovers::Leftovers;

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
    /// Commands of which a call was made to fail.
    pub failed: BTreeSet<String>,
    /// Commands that told other threads of the loss of a device.
    pub told_others: BTreeSet<String>,
    /// True if the layer has counted objects.
    pub counts_objects: bool,
    /// Live objects at the end, by type.
    pub live: BTreeMap<String, usize>,
    /// Objects that were alive when their device or instance was destroyed, by type.
    pub orphans: BTreeMap<String, usize>,
    /// Devices and instances that were destroyed before their objects.
    pub orphaning: usize,
    /// Types of objects that were destroyed though they were not alive.
    pub dead: BTreeSet<String>,
    /// What the process held at its end.
    pub leftovers: Option<Leftovers>,
    /// The result of the first try, a picture or values. `None` if it was not written.
    pub result: Option<Vec<u8>>,
    /// The result of the second try, in the same process after the first has failed.
    pub second_result: Option<Vec<u8>>,
    /// True if the program was to try again after a failure.
    pub tries_again: bool,
    /// Names of files beside the results, and in the caches.
    pub files: BTreeSet<String>,
    /// The next start, with the caches that the run has left, if it has changed them.
    pub next: Option<NextStart>,
}

/// A run without a fault, with the caches of a run with one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NextStart {
    /// The end of the process.
    pub ending: Ending,
    /// The result.
    pub result: Option<Vec<u8>>,
    /// Standard error of the process.
    pub stderr: String,
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
    /// Objects that were destroyed though they were not alive.
    Dead(String),
    /// File descriptors, threads and memory that a run without a fault does not hold at its end.
    Held(String),
    /// Files that a run without fault does not leave.
    Litter(String),
    /// Success with another result.
    WrongResult,
    /// Failure that leaves an incomplete result.
    PartialResult,
    /// Failure without one line that tells the error.
    NoMessage,
    /// An error that names no command.
    UnnamedCommand(String),
    /// An error that names commands, of which none has failed.
    OtherCommand(String),
    /// An error that tells another cause than the one that was injected.
    OtherCause(String),
    /// An error that does not name the object of that command in quotes.
    UnnamedObject(String),
    /// No result of a second try in the same process, or another.
    NotRecovered,
    /// No result of the next start, or another, or a warning.
    BrokenCache(String),
    /// A message of the validation layer.
    Validation(String),
    /// The layer has counted no objects, or the process not what it holds.
    NoCounts,
}

impl fmt::Display for Flaw {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Hang => out.write_str("hang"),
            Self::Signal(signal) => write!(out, "ended by signal {signal}"),
            Self::Panic => out.write_str("panic"),
            Self::Status(status) => write!(out, "status {status}"),
            Self::Leak(objects) => write!(out, "leak of {objects}"),
            Self::Dead(objects) => write!(out, "destroyed twice: {objects}"),
            Self::Held(what) => write!(out, "held at the end: {what}"),
            Self::Litter(files) => write!(out, "left files {files}"),
            Self::WrongResult => out.write_str("wrong result"),
            Self::PartialResult => out.write_str("partial result"),
            Self::NoMessage => out.write_str("no message, or several"),
            Self::UnnamedCommand(message) => write!(out, "the command is not named: {message}"),
            Self::OtherCommand(message) => write!(out, "the command that is named has not failed: {message}"),
            Self::OtherCause(message) => write!(out, "the cause is another: {message}"),
            Self::UnnamedObject(message) => write!(out, "the object is not named: {message}"),
            Self::NotRecovered => out.write_str("a second try in the same process fails"),
            Self::BrokenCache(stderr) => write!(out, "the next start fails or warns: {stderr}"),
            Self::Validation(message) => out.write_str(message),
            Self::NoCounts => out.write_str("the layer has counted no objects"),
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
    let messages = found.stderr.lines().filter(|line| line.starts_with("validation: "));
    flaws.extend(messages.map(|message| Flaw::Validation(message.to_owned())));
    let leaked = found.orphans.iter().chain(&found.live).filter(|(_, count)| **count != 0);
    let leaked: Vec<_> = leaked.map(|(kind, count)| format!("{count} {kind}")).collect();
    let on_purpose = leaks_on_purpose(fault, found);
    if !leaked.is_empty() && !on_purpose {
        flaws.push(Flaw::Leak(leaked.join(", ")));
    }
    if !found.dead.is_empty() {
        flaws.push(Flaw::Dead(found.dead.iter().cloned().collect::<Vec<_>>().join(", ")));
    }
    let held = found.leftovers.as_ref().zip(clean.leftovers.as_ref());
    let held = held.and_then(|(found, clean)| found.beyond(clean));
    flaws.extend(held.filter(|_| !on_purpose).map(Flaw::Held));
    // A fallback may compile other shaders, whose cache files are complete.
    let fell_back = found.ending == Ending::Status(0);
    let is_litter = |name: &&String| !(fell_back && name.starts_with("caches/") && !name.ends_with(".tmp"));
    let litter: Vec<_> = found.files.difference(&clean.files).filter(is_litter).cloned().collect();
    if !litter.is_empty() {
        flaws.push(Flaw::Litter(litter.join(", ")));
    }
    flaws.extend(found.next.as_ref().and_then(|next| judge_next(next, clean)));
    // Without an instance there is nothing to count.
    let counts = found.counts_objects || found.ending != Ending::Status(0);
    let has_ended = matches!(found.ending, Ending::Status(_));
    if !counts || has_ended && found.leftovers.is_none() {
        flaws.push(Flaw::NoCounts);
    }
    flaws
}

/// Judges the next start: the result is right, and nothing warns of a cache that cannot be read.
fn judge_next(next: &NextStart, clean: &RunOutcome) -> Option<Flaw> {
    let is_right = next.ending == Ending::Status(0) && next.result == clean.result;
    let warnings = |stderr: &str| stderr.lines().filter(|line| line.starts_with("warning: ")).count();
    let warns = warnings(&next.stderr) > warnings(&clean.stderr);
    (!is_right || warns).then(|| Flaw::BrokenCache(next.stderr.trim().to_owned()))
}

/// True if the library says that it leaks a context whose work cannot be waited for: every wait and every question about its
/// progress fails for want of memory, so that the device may still use the objects. Each such context accounts for one device that is alive, or that an
/// engine has destroyed before the objects of its guest: what others leak is a flaw.
#[must_use]
pub fn leaks_on_purpose(fault: Option<&Fault>, found: &RunOutcome) -> bool {
    let is_unanswered =
        fault.is_some_and(|fault| fault.span == Span::Unanswered && fault.error.is_want_of_memory());
    let devices = found.live.get("VkDevice").copied().unwrap_or_default() + found.orphaning;
    let contexts = found.stderr.matches(LEAKED).count();
    is_unanswered && contexts > 0 && devices <= contexts
}

/// The end of the warning about a context that is leaked.
const LEAKED: &str = "its objects are leaked, because the device may still use them";

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
        [error] => flaws.extend(fault.and_then(|fault| judge_error(error, fault, found))),
        _ => flaws.push(Flaw::NoMessage),
    }
    if found.tries_again && (found.second_result.is_none() || found.second_result != clean.result) {
        flaws.push(Flaw::NotRecovered);
    }
}

/// Judges the line of an error: it must name a command that has failed, behind it the object of that command, and the cause.
///
/// Two other forms count: the swapchain whose window is gone, for a lost surface, and what needs ray tracing on a device that
/// was created without. Every command concerns an object, those before the device the loader, the instance or the window.
fn judge_error(error: &str, fault: &Fault, found: &RunOutcome) -> Option<Flaw> {
    if fault.error == FaultError::SurfaceLost
        && let Some((before, _)) = error.split_once(WINDOW_IS_GONE)
    {
        let is_named = before.contains(" '") && !before.ends_with('\'');
        return (!is_named).then(|| Flaw::UnnamedObject(error.to_owned()));
    }
    let failed = failed_commands(fault, found);
    let named: Vec<_> = commands_of(error).collect();
    let of_failed: Vec<&str> =
        named.iter().filter(|(command, _)| failed.contains(command)).map(|(_, rest)| *rest).collect();
    if of_failed.is_empty() {
        let flaw = if named.is_empty() { Flaw::UnnamedCommand } else { Flaw::OtherCommand };
        return Some(flaw(error.to_owned()));
    }
    let without_rays = error.split_once(WITHOUT_RAY_TRACING).is_some_and(|(before, _)| before.contains(" '"));
    if !without_rays && !of_failed.into_iter().any(starts_with_object) {
        return Some(Flaw::UnnamedObject(error.to_owned()));
    }
    let lower = error.to_lowercase();
    let tells_cause = fault.error.texts().iter().any(|text| lower.contains(text));
    (!tells_cause).then(|| Flaw::OtherCause(error.to_owned()))
}

/// Returns the commands that an error may name: that of a fault that happens once; those that failed on other threads of a
/// device that it has lost; and all that failed where later calls fail, too, as the library may go on without the first.
fn failed_commands<'a>(fault: &'a Fault, found: &'a RunOutcome) -> BTreeSet<&'a str> {
    let others = if fault.span == Span::Once { &found.told_others } else { &found.failed };
    let mut commands: BTreeSet<&str> = others.iter().map(String::as_str).collect();
    if fault.span == Span::Once {
        commands.insert(&fault.command);
    }
    for (command, name) in OTHER_NAMES {
        if commands.contains(command) {
            commands.insert(name);
        }
    }
    commands
}

/// Commands whose errors may be told as those of another command: the loader calls the first while it creates a device, the
/// result of the second is that of the command that was deferred, and the layer logs the others by the names that were promoted.
const OTHER_NAMES: [(&str, &str); 4] = [
    ("vkEnumerateDeviceExtensionProperties", "vkCreateDevice"),
    ("vkGetDeferredOperationResultKHR", "vkCreateRayTracingPipelinesKHR"),
    ("vkGetPhysicalDeviceCalibrateableTimeDomainsKHR", "vkGetPhysicalDeviceCalibrateableTimeDomainsEXT"),
    ("vkGetCalibratedTimestampsKHR", "vkGetCalibratedTimestampsEXT"),
];

/// True if a text behind a command names its object, as in `vkCreateBuffer for 'rain'` and `vkCreateBuffer failed for 'rain'`.
fn starts_with_object(rest: &str) -> bool {
    let rest = rest.strip_prefix(" failed").unwrap_or(rest);
    rest.strip_prefix(" for '").is_some_and(|name| !name.starts_with('\''))
}

/// A part of errors about ray tracing behind the quoted name of what needs it, on a device that was created without.
const WITHOUT_RAY_TRACING: &str = "vkCreateDevice with ray tracing returned";

/// The end of an error about a lost surface, after the quoted name of the swapchain.
const WINDOW_IS_GONE: &str = "': its window is gone";

/// Returns each Vulkan command of a text, such as `vkMapMemory`, and the text behind it.
fn commands_of(text: &str) -> impl Iterator<Item = (&str, &str)> {
    let is_of_word = |letter: char| letter.is_ascii_alphanumeric();
    text.match_indices("vk").filter_map(move |(start, _)| {
        let (before, word) = text.split_at(start);
        let is_command = word[2..].starts_with(|letter: char| letter.is_ascii_uppercase());
        (is_command && !before.ends_with(is_of_word)).then(|| {
            let rest = word.trim_start_matches(is_of_word);
            (&word[..word.len() - rest.len()], rest)
        })
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
            failed: BTreeSet::new(),
            told_others: BTreeSet::new(),
            counts_objects: true,
            live: BTreeMap::new(),
            orphans: BTreeMap::new(),
            orphaning: 0,
            dead: BTreeSet::new(),
            leftovers: Some(Leftovers { file_descriptors: 4, threads: 1, heap_bytes: 100 }),
            result: Some(b"picture".to_vec()),
            second_result: None,
            tries_again: false,
            files: BTreeSet::from(["caches/pipelines".to_owned()]),
            next: None,
        }
    }

    fn refused() -> RunOutcome {
        RunOutcome {
            ending: Ending::Status(1),
            stderr: "warning: x\nerror: out of host memory in vkCreateBuffer for 'rain'\n".to_owned(),
            reached: true,
            failed: BTreeSet::from(["vkCreateBuffer".to_owned()]),
            result: None,
            second_result: clean().result,
            tries_again: true,
            ..clean()
        }
    }

    fn fault(span: Span) -> Fault {
        Fault { command: "vkCreateBuffer".into(), call: 1, error: FaultError::HostMemory, span }
    }

    fn found(outcome: &RunOutcome) -> Vec<Flaw> {
        flaws(Some(&fault(Span::Once)), outcome, &clean())
    }

    #[test]
    fn the_right_result_and_a_polite_refusal_pass() {
        let other_shader = RunOutcome { files: BTreeSet::from(["caches/3.spirv".to_owned()]), ..clean() };
        let told_others = BTreeSet::from(["vkWaitSemaphores".to_owned()]);
        let stderr = "error: the device was lost in vkWaitSemaphores for 'rain'".to_owned();
        let by_other_thread = RunOutcome { told_others, stderr, ..refused() };
        for outcome in [clean(), refused(), other_shader] {
            assert_eq!(found(&outcome), []);
        }
        let loss = Fault { error: FaultError::DeviceLost, ..fault(Span::Once) };
        assert_eq!(flaws(Some(&loss), &by_other_thread, &clean()), []);
        let twice = RunOutcome { second_result: None, stderr: refused().stderr.repeat(2), ..refused() };
        let one_try = RunOutcome { tries_again: false, ..twice.clone() };
        assert_eq!(found(&one_try), [Flaw::NoMessage], "one try, one error");
        assert_eq!(found(&twice), [Flaw::NoMessage, Flaw::NotRecovered]);
    }

    #[test]
    fn the_next_start_with_the_caches_of_a_run_must_be_right_and_silent() {
        let right = NextStart { ending: Ending::Status(0), result: clean().result, stderr: String::new() };
        let started = |next: NextStart| found(&RunOutcome { next: Some(next), ..refused() });
        assert_eq!(started(right.clone()), []);
        let warning = "warning: the cache is damaged".to_owned();
        for (next, told) in [
            (NextStart { ending: Ending::Status(1), ..right.clone() }, ""),
            (NextStart { result: Some(Vec::new()), ..right.clone() }, ""),
            (NextStart { stderr: warning.clone(), ..right }, &*warning),
        ] {
            assert_eq!(started(next), [Flaw::BrokenCache(told.to_owned())]);
        }
    }

    #[test]
    fn a_run_whose_objects_were_not_counted_says_nothing_of_leaks() {
        assert_eq!(found(&RunOutcome { counts_objects: false, ..clean() }), [Flaw::NoCounts]);
    }

    /// Judges a line of a fault at `command`, where calls of `failed` were made to fail.
    fn judged(command: &str, error: FaultError, span: Span, failed: &[&str], text: &str) -> Option<Flaw> {
        let failed = failed.iter().map(|command| (*command).to_owned()).collect();
        judge_error(
            text,
            &Fault { command: command.into(), call: 1, error, span },
            &RunOutcome { failed, ..refused() },
        )
    }

    #[test]
    fn commands_may_have_the_name_of_their_caller() {
        let named = |command: &str, error, text| judged(command, error, Span::Once, &[command], text);
        let memory = FaultError::HostMemory;
        let other = |text: &str| Some(Flaw::OtherCommand(text.to_owned()));
        let device = "error: out of host memory in vkCreateDevice for 'llvmpipe'";
        assert_eq!(named("vkEnumerateDeviceExtensionProperties", memory, device), None);
        let deferred = "error: out of host memory in vkCreateRayTracingPipelinesKHR for 'rays'";
        assert_eq!(named("vkGetDeferredOperationResultKHR", memory, deferred), None);
        assert_eq!(named("vkCreateBuffer", memory, device), other(device));
        let extensions = ["vkCreateBuffer", "vkEnumerateDeviceExtensionProperties"];
        assert_eq!(judged("vkCreateBuffer", memory, Span::Stays, &extensions, device), None);
        let gone = "error: swapchain 'main': its window is gone";
        assert_eq!(named("vkQueuePresentKHR", FaultError::SurfaceLost, gone), None);
        assert_eq!(named("vkQueuePresentKHR", memory, gone), Some(Flaw::UnnamedCommand(gone.to_owned())));
    }

    #[test]
    fn only_commands_that_have_failed_count() {
        let (memory, lost) = (FaultError::DeviceMemory, FaultError::DeviceLost);
        let image = "error: out of device memory in vkCreateImage for 'rain'";
        let other = Some(Flaw::OtherCommand(image.to_owned()));
        let both = ["vkAllocateMemory", "vkCreateImage"];
        for span in [Span::Command, Span::Stays] {
            assert_eq!(judged("vkAllocateMemory", memory, span, &both, image), None, "{span:?}");
            assert_eq!(judged("vkAllocateMemory", memory, span, &both[..1], image), other, "{span:?}");
        }
        assert_eq!(judged("vkCreateImageView", memory, Span::Stays, &["vkCreateImageView"], image), other);
        // After a loss that happens once, calls of the same thread fail too, but the first is to be told.
        assert_eq!(
            judged("vkQueueSubmit2", lost, Span::Once, &["vkQueueSubmit2", "vkCreateImage"], image),
            other
        );
        let no_command = "error: lvk_faults failed for 'rain'";
        let unnamed = Some(Flaw::UnnamedCommand(no_command.to_owned()));
        assert_eq!(judged("vkCreateImage", memory, Span::Stays, &both, no_command), unnamed);
    }

    #[test]
    fn objects_are_quoted_behind_the_command_that_failed_or_lose_their_window() {
        let failed =
            ["vkMapMemory", "vkGetPhysicalDeviceSurfaceSupportKHR", "vkCreateDevice", "vkQueueSubmit2"];
        let judge = |error, text: &str| judged("vkMapMemory", error, Span::Stays, &failed, text);
        for named in [
            "error: rain: vkMapMemory failed for 'rain': ERROR_SURFACE_LOST_KHR",
            "error: no device (vkGetPhysicalDeviceSurfaceSupportKHR failed for 'window': ERROR_SURFACE_LOST_KHR)",
            "error: swapchain 'main': its window is gone; resume it",
            "error: shader 'a' needs ray queries: vkCreateDevice with ray tracing returned: ERROR_SURFACE_LOST_KHR",
        ] {
            assert_eq!(judge(FaultError::SurfaceLost, named), None, "{named}");
        }
        for unnamed in [
            "error: out of host memory in vkMapMemory",
            "error: out of host memory in vkMapMemory for ''",
            "error: the device was lost in vkQueueSubmit2; the graphics queue had not finished submission 3 'frame'",
            "error: 'rain': vkMapMemory failed: unknown",
            "error: no vkMapMemory after vkCreateBuffer for 'rain'",
            "error: swapchain '': its window is gone; resume it",
            "error: no ray queries: vkCreateDevice with ray tracing returned 'lost'",
        ] {
            let flaw = Some(Flaw::UnnamedObject(unnamed.to_owned()));
            assert_eq!(judge(FaultError::SurfaceLost, unnamed), flaw, "{unnamed}");
        }
        let attached = "error: lvkMapMemory for 'rain'";
        assert_eq!(judge(FaultError::HostMemory, attached), Some(Flaw::UnnamedCommand(attached.to_owned())));
    }

    #[test]
    fn an_error_tells_the_cause_that_was_injected() {
        let judge = |error, text: &str| judged("vkMapMemory", error, Span::Once, &["vkMapMemory"], text);
        for (error, cause) in [
            (FaultError::HostMemory, "out of host memory"),
            (FaultError::DeviceMemory, "out of device memory"),
            (FaultError::DeviceLost, "the device was lost"),
        ] {
            assert_eq!(judge(error, &format!("error: {cause} in vkMapMemory for 'rain'")), None);
            let other = "error: choose another format: vkMapMemory failed for 'rain'".to_owned();
            assert_eq!(judge(error, &other), Some(Flaw::OtherCause(other.clone())));
        }
        let host = "error: out of host memory in vkMapMemory for 'rain'";
        assert_eq!(judge(FaultError::DeviceMemory, host), Some(Flaw::OtherCause(host.to_owned())));
    }

    #[test]
    fn a_context_may_be_leaked_where_its_work_cannot_be_waited_for() {
        let stderr = format!("warning: the end of a context: no memory; {LEAKED}\n{}", refused().stderr);
        let live = BTreeMap::from([("VkDevice".to_owned(), 1)]);
        let leaked = RunOutcome { live, stderr, ..refused() };
        let leak = Flaw::Leak("1 VkDevice".into());
        let judged = |error, span, outcome| flaws(Some(&Fault { error, ..fault(span) }), outcome, &clean());
        assert_eq!(judged(FaultError::HostMemory, Span::Unanswered, &leaked), []);
        let is_leak = std::slice::from_ref(&leak);
        let stderr = leaked.stderr.replace("out of host memory", "the device was lost");
        let lost = RunOutcome { stderr, ..leaked.clone() };
        assert_eq!(judged(FaultError::DeviceLost, Span::Unanswered, &lost), is_leak, "a lost device is idle");
        for span in [Span::Once, Span::Command, Span::Stays] {
            assert_eq!(
                judged(FaultError::HostMemory, span, &leaked),
                is_leak,
                "the timelines answer: {span:?}"
            );
        }
        let orphans = BTreeMap::from([("VkBuffer".to_owned(), 1)]);
        let guest = RunOutcome { live: BTreeMap::new(), orphans, orphaning: 1, ..leaked.clone() };
        assert_eq!(
            judged(FaultError::HostMemory, Span::Unanswered, &guest),
            [],
            "the engine destroys its device"
        );
        let other_context = RunOutcome { live: leaked.live.clone(), ..guest.clone() };
        assert_eq!(
            judged(FaultError::HostMemory, Span::Unanswered, &other_context),
            [Flaw::Leak("1 VkBuffer, 1 VkDevice".into())],
            "one context is leaked on purpose, and another leaks a buffer"
        );
        let silent = RunOutcome { stderr: refused().stderr, ..leaked.clone() };
        assert_eq!(judged(FaultError::HostMemory, Span::Unanswered, &silent), [leak]);
    }

    #[test]
    fn every_flaw_is_caught() {
        let message = "validation: validation error VUID-vkDestroyBuffer: in use";
        let unnamed = "error: out of memory".to_owned();
        let without_object = "error: out of host memory in vkCreateBuffer".to_owned();
        let other = "error: out of host memory in vkCreateImage for 'rain'".to_owned();
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
                RunOutcome { dead: BTreeSet::from(["VkBuffer".to_owned()]), ..clean() },
                Flaw::Dead("VkBuffer".into()),
            ),
            (
                RunOutcome {
                    leftovers: Some(Leftovers { file_descriptors: 6, threads: 1, heap_bytes: 0 }),
                    ..refused()
                },
                Flaw::Held("2 file descriptors".into()),
            ),
            (RunOutcome { leftovers: None, ..refused() }, Flaw::NoCounts),
            (
                RunOutcome { stderr: format!("{message}\n{}", refused().stderr), ..refused() },
                Flaw::Validation(message.to_owned()),
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
            (RunOutcome { stderr: other.clone(), ..refused() }, Flaw::OtherCommand(other)),
            (RunOutcome { stderr: without_object.clone(), ..refused() }, Flaw::UnnamedObject(without_object)),
            (RunOutcome { second_result: None, ..refused() }, Flaw::NotRecovered),
            (RunOutcome { second_result: Some(b"pic".to_vec()), ..refused() }, Flaw::NotRecovered),
        ];
        for (outcome, flaw) in cases {
            assert_eq!(found(&outcome), [flaw]);
        }
    }
}
