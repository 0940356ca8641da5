//! Waits for the presentation engine. Needs no device.

use std::time::Duration;

use crate::error::Result;

/// Maximum time to wait for presents, in nanoseconds. A hidden window may never have a free image, and a terminated
/// engine never finishes a present. The application must not hang because of them.
pub(super) const PRESENT_TIMEOUT_NS: u64 = 1_000_000_000;

/// Waits for all presents. `wait` gets a present and a timeout in nanoseconds, and returns true if the present is
/// finished. After the first timeout, the others get a timeout of 0, because they had the same time. Returns the number
/// of unfinished presents. The first failure is returned only after all presents were waited for.
pub(super) fn wait_for_all<T>(
    presents: impl Iterator<Item = T>,
    mut wait: impl FnMut(T, u64) -> Result<bool>,
) -> Result<usize> {
    let (mut timeout_ns, mut given_up, mut all) = (PRESENT_TIMEOUT_NS, 0, Ok(()));
    for present in presents {
        match wait(present, timeout_ns) {
            Ok(true) => {}
            Ok(false) => {
                timeout_ns = 0;
                given_up += 1;
            }
            Err(error) => all = all.and(Err(error)),
        }
    }
    all.map(|()| given_up)
}

/// Asks for about a second until all presents are finished, after a wait for them failed for lack of memory. `ask`
/// returns the number of unfinished presents, and may lack memory too. Returns the last answer.
pub(super) fn ask_until_finished(
    mut ask: impl FnMut() -> Result<usize>,
    mut pause: impl FnMut(Duration),
) -> Result<usize> {
    const PAUSE: Duration = Duration::from_millis(20);
    const TRIES: usize = 50;
    for _ in 1..TRIES {
        match ask() {
            Ok(0) => return Ok(0),
            Err(error) if !error.lacks_memory() => return Err(error),
            Ok(_) | Err(_) => pause(PAUSE),
        }
    }
    ask()
}

#[cfg(test)]
mod tests {
    use ash::vk;

    use super::*;
    use crate::error::Error;

    #[test]
    fn a_present_that_never_ends_times_out_and_the_others_are_polled() {
        let mut asked = Vec::new();
        let given_up = wait_for_all(0..5, |present, timeout_ns| {
            asked.push((present, timeout_ns));
            Ok(present != 1 && present != 3)
        });
        assert_eq!(given_up.unwrap(), 2);
        let expected = [(0, PRESENT_TIMEOUT_NS), (1, PRESENT_TIMEOUT_NS), (2, 0), (3, 0), (4, 0)];
        assert_eq!(asked, expected);
        assert_eq!(wait_for_all(0..0, |_: u32, _| Ok(false)).unwrap(), 0);
    }

    #[test]
    fn presents_are_asked_for_until_they_are_finished_or_a_second_is_over() {
        let asked = |answers: &[std::result::Result<usize, vk::Result>]| {
            let (mut calls, mut pauses) = (0, 0);
            let ask = || {
                calls += 1;
                answers[(calls - 1).min(answers.len() - 1)].map_err(Error::vulkan("vkGetFenceStatus", "test"))
            };
            let answer = ask_until_finished(ask, |_| pauses += 1);
            (answer.map_err(|error| error.to_string().contains("memory")), calls, pauses)
        };
        let (lost, short) = (vk::Result::ERROR_DEVICE_LOST, vk::Result::ERROR_OUT_OF_HOST_MEMORY);
        assert_eq!(asked(&[Ok(0)]), (Ok(0), 1, 0));
        assert_eq!(asked(&[Err(short), Ok(2), Ok(0)]), (Ok(0), 3, 2));
        assert_eq!(asked(&[Ok(2), Err(lost)]), (Err(false), 2, 1));
        assert_eq!(asked(&[Ok(2)]), (Ok(2), 50, 49));
        assert_eq!(asked(&[Err(short)]), (Err(true), 50, 49));
    }

    #[test]
    fn a_failure_is_answered_once_all_were_waited_for() {
        let mut asked = 0;
        let failed = wait_for_all(0..4, |present, _| {
            asked += 1;
            if present % 2 == 1 { Err(Error::usage("present", present.to_string())) } else { Ok(true) }
        });
        assert!(failed.unwrap_err().to_string().contains('1'), "the first");
        assert_eq!(asked, 4);
    }
}
