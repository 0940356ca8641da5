//! The verdict on one run: decided from plain values.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use crate::call_log::{Call, NamedObject};
use crate::fault::{Fault, Span};
use crate::leftovers::Leftovers;

use super::error_line::{commands_of, judge_error, names_of};
use super::evidence::is_seen;
use super::fallbacks::documented;

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
    /// The calls, in order.
    pub calls: Vec<Call>,
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
    /// Commands that used a command buffer which an earlier call had not begun or reset, because it had failed.
    pub unready: BTreeSet<String>,
    /// Objects that have names. A run without a fault has those that it names for a tool, too.
    pub names: BTreeSet<NamedObject>,
    /// Names of physical devices.
    pub devices: BTreeSet<String>,
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
    /// Commands that used a command buffer which an earlier call had not begun or reset, because it had failed.
    Unready(String),
    /// A swapchain that is out of date, and that is not made anew for the next frame.
    NotRemade,
    /// File descriptors, threads and memory that a run without a fault does not hold at its end.
    Held(String),
    /// Files that a run without fault does not leave.
    Litter(String),
    /// Success with another result.
    WrongResult,
    /// Success after the failure of a command that no warning names, without a documented fallback that the calls show.
    SwallowedError(String),
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
            Self::Unready(commands) => write!(out, "a command buffer is not ready for {commands}"),
            Self::NotRemade => out.write_str("the swapchain that is out of date is not made anew"),
            Self::Held(what) => write!(out, "held at the end: {what}"),
            Self::Litter(files) => write!(out, "left files {files}"),
            Self::WrongResult => out.write_str("wrong result"),
            Self::SwallowedError(commands) => {
                write!(
                    out,
                    "right result in silence, without a documented fallback that is seen, after {commands}"
                )
            }
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
    if !found.unready.is_empty() {
        flaws.push(Flaw::Unready(found.unready.iter().cloned().collect::<Vec<_>>().join(", ")));
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
    let has_ended = matches!(found.ending, Ending::Status(_));
    let counts_objects = found.counts_objects || has_no_instance(found);
    if !counts_objects || has_ended && found.leftovers.is_none() {
        flaws.push(Flaw::NoCounts);
    }
    flaws
}

/// True if a command has failed before there was an instance, and none was created: there are no objects to count.
fn has_no_instance(found: &RunOutcome) -> bool {
    let is_before =
        |command: &String| command == "vkCreateInstance" || command.starts_with("vkEnumerateInstance");
    let creates = |call: &Call| call.command == "vkCreateInstance" && !call.fails;
    found.failed.iter().any(is_before) && !found.calls.iter().any(creates)
}

/// Judges the next start: the result is right, and nothing warns of a cache that cannot be read.
fn judge_next(next: &NextStart, clean: &RunOutcome) -> Option<Flaw> {
    let is_right = next.ending == Ending::Status(0) && next.result == clean.result;
    let warnings = |stderr: &str| stderr.lines().filter(|line| line.starts_with("warning: ")).count();
    let warns = warnings(&next.stderr) > warnings(&clean.stderr);
    (!is_right || warns).then(|| Flaw::BrokenCache(next.stderr.trim().to_owned()))
}

/// True if the library says that it leaks a context whose work cannot be waited for: every wait and every question about its
/// progress fails for lack of memory, so that the device may still use the objects. Each such context accounts for one device that is alive, or that an
/// engine has destroyed before the objects of its guest, and for one instance: what others leak is a flaw. Objects are counted when an instance is
/// created or destroyed, so what a leaked context has is not known.
#[must_use]
pub fn leaks_on_purpose(fault: Option<&Fault>, found: &RunOutcome) -> bool {
    let is_unanswered =
        fault.is_some_and(|fault| fault.span == Span::Unanswered && fault.error.is_shortage());
    let live = |kind: &str| found.live.get(kind).copied().unwrap_or_default();
    let contexts = found.stderr.matches(LEAKED).count();
    let accounts = live("VkDevice") + found.orphaning <= contexts && live("VkInstance") <= contexts;
    is_unanswered && contexts > 0 && accounts
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
        flaws.extend(fault.and_then(|fault| judge_silence(fault, found, clean)));
        return;
    }
    if found.result.is_some() && found.result != clean.result {
        flaws.push(Flaw::PartialResult);
    }
    let errors: Vec<&str> = found.stderr.lines().filter(|line| line.starts_with("error: ")).collect();
    match *errors {
        [error] => flaws.extend(fault.and_then(|fault| judge_error(error, fault, found, clean))),
        _ => flaws.push(Flaw::NoMessage),
    }
    if found.tries_again && (found.second_result.is_none() || found.second_result != clean.result) {
        flaws.push(Flaw::NotRecovered);
    }
}

/// Judges a success in spite of a fault: a warning names each command that failed, or the command has a documented fallback,
/// and the calls of the run show it.
fn judge_silence(fault: &Fault, found: &RunOutcome, clean: &RunOutcome) -> Option<Flaw> {
    let warnings = found.stderr.lines().filter(|line| line.starts_with("warning: "));
    let named: BTreeSet<&str> = warnings.flat_map(commands_of).map(|(command, _)| command).collect();
    let is_silent = |command: &&String| {
        let instead = documented(command, fault.error);
        let is_explained = instead.is_some_and(|instead| is_seen(instead, command, fault, found, clean));
        !is_explained && !names_of(command).any(|name| named.contains(name))
    };
    let silent: Vec<_> = found.failed.iter().filter(is_silent).cloned().collect();
    (!silent.is_empty()).then(|| Flaw::SwallowedError(silent.join(", ")))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::call_log::tests::calls;
    use crate::fault::FaultError;

    /// Objects of a kind and a name each.
    pub(in crate::sweep) fn named(objects: &[(&str, &str)]) -> BTreeSet<NamedObject> {
        let object =
            |&(kind, name): &(&str, &str)| NamedObject { kind: kind.to_owned(), name: name.to_owned() };
        objects.iter().map(object).collect()
    }

    pub(in crate::sweep) fn clean() -> RunOutcome {
        RunOutcome {
            ending: Ending::Status(0),
            stderr: String::new(),
            reached: false,
            calls: Vec::new(),
            unready: BTreeSet::new(),
            names: named(&[("BUFFER", "rain"), ("SEMAPHORE", "graphics timeline")]),
            devices: BTreeSet::from(["llvmpipe".to_owned()]),
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

    pub(in crate::sweep) fn refused() -> RunOutcome {
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
        let stderr = "error: the device was lost in vkWaitSemaphores for 'graphics timeline'".to_owned();
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
        let uncounted = |outcome: RunOutcome| found(&RunOutcome { counts_objects: false, ..outcome });
        assert_eq!(uncounted(clean()), [Flaw::NoCounts]);
        assert_eq!(
            uncounted(refused()),
            [Flaw::NoCounts],
            "an error does not say that there was no instance"
        );
        let without_instance = |command: &str, object: &str, calls_made: &str| RunOutcome {
            calls: calls(calls_made),
            failed: BTreeSet::from([command.to_owned()]),
            stderr: format!("error: out of host memory in {command} for '{object}'"),
            ..refused()
        };
        for (command, object) in
            [("vkCreateInstance", "instance"), ("vkEnumerateInstanceVersion", "Vulkan loader")]
        {
            let fault = Fault { command: command.into(), ..fault(Span::Once) };
            let judged = |made: &str| {
                let outcome = RunOutcome { counts_objects: false, ..without_instance(command, object, made) };
                flaws(Some(&fault), &outcome, &clean())
            };
            assert_eq!(judged(&format!("{command}!")), [], "{command}");
            assert_eq!(judged(&format!("{command}! vkCreateInstance")), [Flaw::NoCounts], "{command}");
        }
    }

    #[test]
    fn a_right_result_is_documented_or_told_by_a_warning() {
        let failed = |commands: &[&str], stderr: &str| RunOutcome {
            failed: commands.iter().map(|command| (*command).to_owned()).collect(),
            stderr: stderr.to_owned(),
            ..clean()
        };
        let swallowed = |commands: &str| vec![Flaw::SwallowedError(commands.to_owned())];
        let loses_name = "vkSetDebugUtilsObjectNameEXT";
        assert_eq!(found(&failed(&[loses_name], "")), []);
        let of_memory = Fault { command: "vkAllocateMemory".into(), ..fault(Span::Once) };
        let allocates = |made: &str| RunOutcome { calls: calls(made), ..failed(&["vkAllocateMemory"], "") };
        let without = RunOutcome { calls: calls("vkAllocateMemory"), ..clean() };
        assert_eq!(flaws(Some(&of_memory), &allocates("vkAllocateMemory! vkAllocateMemory"), &without), []);
        assert_eq!(
            flaws(Some(&of_memory), &allocates("vkAllocateMemory!"), &without),
            swallowed("vkAllocateMemory"),
            "none in its place"
        );
        let waits = Fault { command: "vkQueueWaitIdle".into(), ..fault(Span::Once) };
        let ends = |made: &str| {
            flaws(
                Some(&waits),
                &RunOutcome { calls: calls(made), ..failed(&["vkQueueWaitIdle"], "") },
                &clean(),
            )
        };
        assert_eq!(ends("vkQueueSubmit2 vkQueueWaitIdle! vkGetSemaphoreCounterValue"), []);
        assert_eq!(
            ends("vkQueueSubmit2 vkQueueWaitIdle!"),
            swallowed("vkQueueWaitIdle"),
            "the end is not seen"
        );
        assert_eq!(found(&failed(&["vkCreateBuffer"], "")), swallowed("vkCreateBuffer"));
        let both = ["vkCreateBuffer", loses_name, "vkCreateImage"];
        assert_eq!(found(&failed(&both, "")), swallowed("vkCreateBuffer, vkCreateImage"));
        let warning = "warning: no cache: out of host memory in vkCreateBuffer for 'rain'\n";
        assert_eq!(found(&failed(&both[..2], warning)), []);
        assert_eq!(found(&failed(&both, warning)), swallowed("vkCreateImage"));
        let note = "note: vkCreateBuffer for 'rain'\n";
        assert_eq!(found(&failed(&both[..1], note)), swallowed("vkCreateBuffer"), "a note is no warning");
        let loss = Fault { error: FaultError::DeviceLost, ..fault(Span::Once) };
        let lost = failed(&["vkGetImageMemoryRequirements2"], "");
        assert_eq!(flaws(Some(&loss), &lost, &clean()), swallowed("vkGetImageMemoryRequirements2"));
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
        let two = BTreeMap::from([("VkDevice".to_owned(), 1), ("VkInstance".to_owned(), 2)]);
        let other_instance = RunOutcome { live: two, ..leaked.clone() };
        let flaw = [Flaw::Leak("1 VkDevice, 2 VkInstance".into())];
        assert_eq!(
            judged(FaultError::HostMemory, Span::Unanswered, &other_instance),
            flaw,
            "an instance of another"
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
                RunOutcome { unready: BTreeSet::from(["vkEndCommandBuffer".to_owned()]), ..clean() },
                Flaw::Unready("vkEndCommandBuffer".into()),
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
