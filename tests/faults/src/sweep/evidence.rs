//! Evidence of a fallback in the calls of a run.

use super::fallbacks::Instead;
use super::verdict::RunOutcome;
use crate::call_log::Call;
use crate::fault::{Fault, FaultError, PRESENTED, PROGRESS, Span};

/// True if the calls of a run with `fault` show what the library does in place of the calls of `command` that have failed.
pub(super) fn is_seen(
    instead: Instead,
    command: &str,
    fault: &Fault,
    found: &RunOutcome,
    clean: &RunOutcome,
) -> bool {
    let calls = |outcome: &RunOutcome| count(outcome, |call| call.command == command);
    match instead {
        // How often a program asks depends on the speed of the device.
        Instead::AsksAgain if fault.span == Span::Once => is_followed_by_success(command, &found.calls),
        Instead::CallsAgain if fault.span == Span::Once => calls(found) > calls(clean),
        Instead::AllocatesAgain if fault.span == Span::Once => {
            calls(found) > calls(clean) || is_called_again_at_once(command, &found.calls)
        }
        // Where later calls fail too, a second call fails.
        Instead::CallsAgain | Instead::AllocatesAgain | Instead::AsksAgain => {
            count(found, |call| call.command == command && call.fails) > 1
        }
        Instead::AsksForPresents => asks_for_presents(command, &found.calls),
        Instead::BeginsLater => found.unready.is_empty(),
        Instead::WaitsOtherwise => waits_otherwise(command, fault.error, &found.calls),
        Instead::RemakesSwapchain => remakes_swapchain(command, &found.calls),
        Instead::LosesName => true,
    }
}

fn count(outcome: &RunOutcome, counts: impl Fn(&Call) -> bool) -> usize {
    outcome.calls.iter().filter(|call| counts(call)).count()
}

/// True if a call of `command` has failed, and the next call of all behind each one that fails is one of `command` that succeeds.
fn is_called_again_at_once(command: &str, calls: &[Call]) -> bool {
    let failures = calls.iter().enumerate().filter(|(_, call)| call.command == command && call.fails);
    let mut next = failures.map(|(place, _)| calls.get(place + 1)).peekable();
    next.peek().is_some() && next.all(|call| call.is_some_and(|call| call.command == command && !call.fails))
}

/// True if a call of `command` that succeeds lies behind each one that fails.
fn is_followed_by_success(command: &str, calls: &[Call]) -> bool {
    let last = |fails: bool| calls.iter().rposition(|call| call.command == command && call.fails == fails);
    last(true) < last(false)
}

/// True if no image is presented behind the last wait of `command` that has failed, and a question about a present has succeeded behind it.
fn asks_for_presents(command: &str, calls: &[Call]) -> bool {
    let last = |is_meant: &dyn Fn(&Call) -> bool| calls.iter().rposition(is_meant);
    let failure = last(&|call| call.fails && call.command == command);
    let answer = last(&|call| !call.fails && call.command == PRESENTED);
    last(&|call| call.command == "vkQueuePresentKHR") < failure && failure < answer
}

/// True if no more work follows the wait of `command` that has failed, and a wait or a question about the progress of work has
/// succeeded behind the last work. A lost device has no work.
fn waits_otherwise(command: &str, error: FaultError, calls: &[Call]) -> bool {
    let last = |is_meant: fn(&Call) -> bool| calls.iter().rposition(is_meant);
    let work = last(|call| call.command.starts_with("vkQueueSubmit") || call.command == "vkQueuePresentKHR");
    let end = last(|call| {
        !call.fails && matches!(&*call.command, "vkQueueWaitIdle" | "vkWaitSemaphores" | PROGRESS)
    });
    let failure = calls.iter().position(|call| call.fails && call.command == command);
    work < failure && (!error.is_shortage() || work < end)
}

/// True if the creation of a swapchain lies between each failure of `command` and the next acquisition.
pub(super) fn remakes_swapchain(command: &str, calls: &[Call]) -> bool {
    let mut is_stale = false;
    for call in calls {
        match &*call.command {
            "vkCreateSwapchainKHR" if !call.fails => is_stale = false,
            "vkAcquireNextImageKHR" if is_stale => return false,
            _ => {}
        }
        is_stale |= call.fails && call.command == command;
    }
    true
}

#[cfg(test)]
mod tests {
    use super::super::verdict::tests::clean;
    use super::*;
    use crate::call_log::tests::calls;

    fn outcome(text: &str) -> RunOutcome {
        RunOutcome { calls: calls(text), ..clean() }
    }

    /// True if the calls `found` show what is done instead of `command`, where a run without a fault has the calls `without`.
    fn seen(instead: Instead, command: &str, span: Span, found: &str, without: &str) -> bool {
        let fault = Fault { command: command.into(), call: 1, error: FaultError::HostMemory, span };
        is_seen(instead, command, &fault, &outcome(found), &outcome(without))
    }

    #[test]
    fn a_command_is_called_again() {
        let again = |span, found: &str| seen(Instead::CallsAgain, "vkMapMemory", span, found, "vkMapMemory");
        assert!(again(Span::Once, "vkMapMemory! vkMapMemory"));
        assert!(!again(Span::Once, "vkMapMemory!"));
        let with_two = |instead, command: &str, found: &str| {
            let [found, without] = [found, "call call"].map(|text| text.replace("call", command));
            seen(instead, command, Span::Once, &found, &without)
        };
        let allocated = |found: &str| with_two(Instead::AllocatesAgain, "vkAllocateMemory", found);
        assert!(allocated("call! call vkCreateBuffer"), "at once");
        assert!(!allocated("call! vkCreateBuffer call"), "as often, and later");
        assert!(!allocated("call call"), "none fails");
        let created = with_two(Instead::CallsAgain, "vkCreateBuffer", "call! call vkBindBufferMemory");
        assert!(!created, "another buffer");
        for span in [Span::Command, Span::Stays, Span::Unanswered] {
            assert!(again(span, "vkMapMemory! vkMapMemory!"), "{span:?}");
            assert!(!again(span, "vkMapMemory vkMapMemory!"), "{span:?}");
        }
    }

    #[test]
    fn a_question_is_asked_again_behind_the_one_that_failed() {
        let again = |span, found: &str| seen(Instead::AsksAgain, PROGRESS, span, found, PROGRESS);
        let [ask, fail] = [PROGRESS.to_owned(), format!("{PROGRESS}!")];
        assert!(again(Span::Once, &format!("{fail} {ask}")));
        assert!(!again(Span::Once, &format!("{ask} {ask} {fail}")), "more often, but not behind the failure");
        assert!(again(Span::Unanswered, &format!("{fail} {fail}")));
        assert!(!again(Span::Unanswered, &format!("{ask} {fail}")));
    }

    #[test]
    fn a_command_buffer_is_ready_where_it_is_used() {
        let begin = "vkBeginCommandBuffer";
        assert!(seen(Instead::BeginsLater, begin, Span::Once, "vkBeginCommandBuffer!", ""));
        let found = RunOutcome { unready: ["vkEndCommandBuffer".to_owned()].into(), ..clean() };
        let fault = Fault { command: begin.into(), call: 1, error: FaultError::HostMemory, span: Span::Once };
        assert!(!is_seen(Instead::BeginsLater, begin, &fault, &found, &clean()));
    }

    #[test]
    fn the_end_of_the_work_is_seen_behind_the_last_of_it() {
        let wait = "vkQueueWaitIdle";
        let waits = |found: &str| seen(Instead::WaitsOtherwise, wait, Span::Stays, found, "");
        assert!(waits("vkQueueSubmit2 vkQueueWaitIdle! vkQueueWaitIdle"));
        assert!(waits("vkQueueSubmit2 vkQueueWaitIdle! vkGetSemaphoreCounterValue"));
        assert!(waits("vkQueueSubmit2 vkWaitSemaphores vkQueueWaitIdle!"));
        assert!(!waits("vkQueueSubmit2 vkQueueWaitIdle!"));
        assert!(!waits("vkWaitSemaphores vkQueueSubmit2 vkQueueWaitIdle! vkWaitSemaphores!"));
        assert!(!waits("vkQueueWaitIdle! vkQueueSubmit2 vkWaitSemaphores"), "work goes on");
        let lost = |found: &str| waits_otherwise(wait, FaultError::DeviceLost, &calls(found));
        assert!(lost("vkQueueSubmit2 vkQueueWaitIdle!"), "a lost device has no work");
        assert!(!lost("vkQueueWaitIdle! vkQueueSubmit2"));
    }

    #[test]
    fn presents_are_asked_for_where_they_cannot_be_waited_for() {
        let asks = |found: &str| seen(Instead::AsksForPresents, "vkWaitForFences", Span::Stays, found, "");
        assert!(asks("vkQueuePresentKHR vkWaitForFences! vkGetFenceStatus"));
        assert!(asks("vkQueuePresentKHR vkWaitForFences! vkGetFenceStatus! vkGetFenceStatus"));
        assert!(!asks("vkQueuePresentKHR vkWaitForFences! vkGetFenceStatus!"));
        assert!(!asks("vkQueuePresentKHR vkGetFenceStatus vkWaitForFences!"));
        assert!(!asks("vkWaitForFences! vkQueuePresentKHR vkGetFenceStatus"), "another frame");
    }

    #[test]
    fn a_swapchain_is_made_anew_for_the_next_frame() {
        let remakes = |text: &str| {
            let long = text.replace("make", "vkCreateSwapchainKHR").replace("next", "vkAcquireNextImageKHR");
            ["vkAcquireNextImageKHR", "vkQueuePresentKHR"]
                .map(|command| remakes_swapchain(command, &calls(&long)))
        };
        assert_eq!(remakes("make next! make next! make! make next vkQueuePresentKHR"), [true; 2]);
        assert_eq!(remakes("make next vkQueuePresentKHR!"), [true; 2], "no frame follows");
        assert_eq!(remakes("make next! next"), [false, true]);
        assert_eq!(remakes("make next! make! next"), [false, true]);
        assert_eq!(remakes("make next vkQueuePresentKHR! next make"), [true, false]);
    }
}
