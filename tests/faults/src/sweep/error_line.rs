//! The line of an error: which command it names, which object, and which cause.

use std::collections::BTreeSet;

use super::evidence::remakes_swapchain;
use super::object_names::KnownObjects;
use super::verdict::{Flaw, RunOutcome};
use crate::fault::{Fault, FaultError, Span};

/// Judges the line of an error: it must name a command that has failed, behind it the object of that command, and the cause.
///
/// Two other forms count: the swapchain that stays out of date; and what needs ray tracing on a device that was created without.
/// Every command concerns an object, those before the device the loader, the instance or the window.
pub(super) fn judge_error(
    error: &str,
    fault: &Fault,
    found: &RunOutcome,
    clean: &RunOutcome,
) -> Option<Flaw> {
    let objects = KnownObjects::of(found, clean);
    if fault.error == FaultError::OutOfDate
        && fault.span != Span::Once
        && let Some((before, _)) = error.split_once(STAYS_OUT_OF_DATE)
    {
        return judge_no_image(error, &objects, before, found);
    }
    let failed = failed_commands(fault, found);
    let named: Vec<_> = commands_of(error).collect();
    let of_failed: Vec<_> = named.iter().filter(|(command, _)| failed.contains(command)).collect();
    if of_failed.is_empty() {
        let flaw = if named.is_empty() { Flaw::UnnamedCommand } else { Flaw::OtherCommand };
        return Some(flaw(error.to_owned()));
    }
    let without_rays = error.split_once(WITHOUT_RAY_TRACING).is_some_and(|(before, _)| objects.occur(before));
    if !without_rays && !of_failed.into_iter().any(|(command, rest)| objects.follow(command, rest)) {
        return Some(Flaw::UnnamedObject(error.to_owned()));
    }
    let lower = error.to_lowercase();
    let tells_cause = fault.error.texts().iter().any(|text| lower.contains(text));
    (!tells_cause).then(|| Flaw::OtherCause(error.to_owned()))
}

/// Judges the error of a program that gives up a swapchain which stays out of date: `before` ends with its name, and it was made
/// anew for each frame.
fn judge_no_image(error: &str, objects: &KnownObjects<'_>, before: &str, found: &RunOutcome) -> Option<Flaw> {
    if !objects.end_with_swapchain(before) {
        return Some(Flaw::UnnamedObject(error.to_owned()));
    }
    let is_remade = found.failed.iter().all(|command| remakes_swapchain(command, &found.calls));
    (!is_remade).then_some(Flaw::NotRemade)
}

/// Returns the commands that an error may name: that of a fault that happens once; those that failed on other threads of a
/// device that it has lost; and all that failed where later calls fail, too, as the library may go on without the first.
fn failed_commands<'a>(fault: &'a Fault, found: &'a RunOutcome) -> BTreeSet<&'a str> {
    let others = if fault.span == Span::Once { &found.told_others } else { &found.failed };
    let mut commands: BTreeSet<&str> = others.iter().map(String::as_str).collect();
    if fault.span == Span::Once {
        commands.insert(&fault.command);
    }
    commands.iter().flat_map(|command| names_of(command)).collect()
}

/// Returns the names that texts may give a command.
pub(super) fn names_of(command: &str) -> impl Iterator<Item = &str> {
    let other = OTHER_NAMES.iter().find(|(of, _)| *of == command).map(|(_, name)| *name);
    std::iter::once(command).chain(other)
}

/// Commands whose errors may be told as those of another command: the loader calls the first while it creates a device, the
/// result of the second is that of the command that was deferred, and the layer logs the others by the names that were promoted.
const OTHER_NAMES: [(&str, &str); 4] = [
    ("vkEnumerateDeviceExtensionProperties", "vkCreateDevice"),
    ("vkGetDeferredOperationResultKHR", "vkCreateRayTracingPipelinesKHR"),
    ("vkGetPhysicalDeviceCalibrateableTimeDomainsKHR", "vkGetPhysicalDeviceCalibrateableTimeDomainsEXT"),
    ("vkGetCalibratedTimestampsKHR", "vkGetCalibratedTimestampsEXT"),
];

/// A part of errors about ray tracing behind the quoted name of what needs it, on a device that was created without.
const WITHOUT_RAY_TRACING: &str = "vkCreateDevice with ray tracing returned";

/// The end of a scenario's error about a swapchain without an image, after its quoted name.
const STAYS_OUT_OF_DATE: &str = "' stays out of date";

/// Returns each Vulkan command of a text, such as `vkMapMemory`, and the text behind it.
pub(super) fn commands_of(text: &str) -> impl Iterator<Item = (&str, &str)> {
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
    use super::super::verdict::tests::{clean, named, refused};
    use super::*;

    const NAMED: [(&str, &str); 5] = [
        ("BUFFER", "rain"),
        ("IMAGE", "rain"),
        ("SWAPCHAIN_KHR", "main"),
        ("SHADER_MODULE", "a"),
        ("PIPELINE", "rays"),
    ];

    /// Judges a line of a fault at `command`, where calls of `failed` were made to fail.
    fn judged(command: &str, error: FaultError, span: Span, failed: &[&str], text: &str) -> Option<Flaw> {
        let failed = failed.iter().map(|command| (*command).to_owned()).collect();
        judge_error(
            text,
            &Fault { command: command.into(), call: 1, error, span },
            &RunOutcome { failed, ..refused() },
            &RunOutcome { names: named(&NAMED), ..clean() },
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
        let unnamed = Some(Flaw::UnnamedCommand(gone.to_owned()));
        assert_eq!(named("vkQueuePresentKHR", FaultError::SurfaceLost, gone), unnamed);
        let found = "error: swapchain 'main': its window is gone (vkQueuePresentKHR failed for 'main': lost)";
        assert_eq!(named("vkQueuePresentKHR", FaultError::SurfaceLost, found), None);
        assert_eq!(named("vkQueuePresentKHR", memory, found), Some(Flaw::OtherCause(found.to_owned())));
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
            "error: shader 'a' needs ray queries: vkCreateDevice with ray tracing returned: ERROR_SURFACE_LOST_KHR",
        ] {
            assert_eq!(judge(FaultError::SurfaceLost, named), None, "{named}");
        }
        for unnamed in [
            "error: out of host memory in vkMapMemory",
            "error: out of host memory in vkMapMemory for ''",
            "error: out of host memory in vkMapMemory for 'snow'",
            "error: shader 'b' needs ray queries: vkCreateDevice with ray tracing returned: ERROR_SURFACE_LOST_KHR",
            "error: the device was lost in vkQueueSubmit2; the graphics queue had not finished submission 3 'frame'",
            "error: 'rain': vkMapMemory failed: unknown",
            "error: no vkMapMemory after vkCreateBuffer for 'rain'",
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
    fn a_swapchain_that_stays_out_of_date_is_made_anew_for_each_frame() {
        let judge = |error, span, text: &str, calls: &str| {
            let found = RunOutcome {
                calls: crate::call_log::tests::calls(calls),
                failed: ["vkAcquireNextImageKHR".to_owned()].into(),
                ..refused()
            };
            judge_error(
                text,
                &Fault { command: "vkAcquireNextImageKHR".into(), call: 1, error, span },
                &found,
                &RunOutcome { names: named(&NAMED), ..clean() },
            )
        };
        let remade =
            "vkCreateSwapchainKHR vkAcquireNextImageKHR! vkCreateSwapchainKHR vkAcquireNextImageKHR!";
        let stuck = "vkCreateSwapchainKHR vkAcquireNextImageKHR! vkAcquireNextImageKHR!";
        let stale = "error: the swapchain 'main' stays out of date: 20 frames have no image";
        let (dated, stays) = (FaultError::OutOfDate, Span::Stays);
        assert_eq!(judge(dated, stays, stale, remade), None);
        assert_eq!(judge(dated, stays, stale, stuck), Some(Flaw::NotRemade));
        let other = stale.replace("main", "rain");
        assert_eq!(judge(dated, stays, &other, remade), Some(Flaw::UnnamedObject(other.clone())));
        for (error, span) in [(dated, Span::Once), (FaultError::HostMemory, stays)] {
            assert_eq!(judge(error, span, stale, remade), Some(Flaw::UnnamedCommand(stale.to_owned())));
        }
    }
}
