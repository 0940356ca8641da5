//! Answers of a driver's queries: lists in two calls, and what means that an image is not supported.

use ash::vk;

use crate::error::{Error, Result};

/// Most times that a list is asked for again because it has grown between its two calls.
const MAX_TRIES: usize = 16;

/// Returns a list of the driver through `ask`, which works like Vulkan's commands with a count and an array: with a null pointer it
/// writes the number of entries, else at most that many entries and their number. A list that has grown meanwhile is asked for again.
///
/// # Errors
/// Those of `ask`. `ERROR_OUT_OF_HOST_MEMORY` if the host has no memory for the list, and `INCOMPLETE` if it grows each time.
pub(crate) fn listed<T: Clone + Default>(
    mut ask: impl FnMut(&mut u32, *mut T) -> vk::Result,
) -> Result<Vec<T>, vk::Result> {
    for _ in 0..MAX_TRIES {
        let mut count = 0;
        ask(&mut count, std::ptr::null_mut()).result()?;
        let mut list = Vec::new();
        list.try_reserve_exact(count as usize).map_err(|_| vk::Result::ERROR_OUT_OF_HOST_MEMORY)?;
        list.resize(count as usize, T::default());
        match ask(&mut count, list.as_mut_ptr()) {
            vk::Result::INCOMPLETE => {}
            answer => {
                answer.result()?;
                list.truncate(count as usize);
                return Ok(list);
            }
        }
    }
    Err(vk::Result::INCOMPLETE)
}

/// Returns the answer of `command` about an image: `None` if the driver does not support it. `name` is the object in the error.
///
/// # Errors
/// Every other error of the command, such as a shortage of memory, which says nothing about the image.
pub(crate) fn image_support<T>(
    answer: Result<T, vk::Result>,
    command: &'static str,
    name: &str,
) -> Result<Option<T>> {
    match answer {
        Ok(found) => Ok(Some(found)),
        Err(vk::Result::ERROR_FORMAT_NOT_SUPPORTED) => Ok(None),
        Err(failure) => Err(Error::vulkan(command, name)(failure)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Answers as a driver would whose list has these lengths, one a call. Writes the numbers from 1 on.
    fn driver(lengths: &[u32]) -> impl FnMut(&mut u32, *mut u32) -> vk::Result {
        let mut lengths = lengths.iter().copied().cycle();
        move |count, list| {
            let length = lengths.next().unwrap();
            if list.is_null() {
                *count = length;
                return vk::Result::SUCCESS;
            }
            let room = *count;
            *count = length.min(room);
            // SAFETY: the list has room for the entries of the caller's count.
            (0..*count).for_each(|index| unsafe { *list.add(index as usize) = index + 1 });
            if room < length { vk::Result::INCOMPLETE } else { vk::Result::SUCCESS }
        }
    }

    #[test]
    fn a_list_is_whole_and_may_shrink_or_grow_between_its_calls() {
        assert_eq!(listed(driver(&[3])), Ok(vec![1, 2, 3]));
        assert_eq!(listed(driver(&[0])), Ok(vec![]));
        assert_eq!(listed(driver(&[3, 1])), Ok(vec![1]), "it has shrunk");
        assert_eq!(listed(driver(&[2, 4, 4, 4])), Ok(vec![1, 2, 3, 4]), "it is asked for again");
    }

    #[test]
    fn a_list_that_grows_each_time_is_incomplete_in_the_end() {
        let (mut calls, mut driver) = (0, driver(&[1, 2]));
        let answer = listed(|count, list| {
            calls += 1;
            driver(count, list)
        });
        assert_eq!((answer, calls), (Err(vk::Result::INCOMPLETE), 2 * MAX_TRIES));
    }

    #[test]
    fn errors_of_either_call_are_told() {
        for error in [vk::Result::ERROR_OUT_OF_HOST_MEMORY, vk::Result::ERROR_OUT_OF_DEVICE_MEMORY] {
            let mut calls = 0;
            let first = listed(|_, _: *mut u32| {
                calls += 1;
                error
            });
            assert_eq!((first, calls), (Err(error), 1));
            let mut driver = driver(&[3]);
            let second =
                listed(|count, list: *mut u32| if list.is_null() { driver(count, list) } else { error });
            assert_eq!(second, Err(error));
        }
    }

    /// A driver that announces more entries than the host has memory for.
    #[test]
    fn a_list_beyond_the_hosts_memory_is_an_error() {
        let answer = listed(|count, list: *mut [[[u64; 32]; 32]; 32]| {
            assert!(list.is_null());
            *count = u32::MAX;
            vk::Result::SUCCESS
        });
        assert_eq!(answer.err(), Some(vk::Result::ERROR_OUT_OF_HOST_MEMORY));
    }

    #[test]
    fn only_an_unsupported_format_means_no_support() {
        let asked = |answer| image_support(answer, "vkGetPhysicalDeviceImageFormatProperties2", "sky");
        assert!(matches!(asked(Ok(7)), Ok(Some(7))));
        assert!(matches!(asked(Err(vk::Result::ERROR_FORMAT_NOT_SUPPORTED)), Ok(None)));
        let text = |failure| asked(Err(failure)).unwrap_err().to_string();
        assert_eq!(
            text(vk::Result::ERROR_OUT_OF_HOST_MEMORY),
            "out of host memory in vkGetPhysicalDeviceImageFormatProperties2 for 'sky'"
        );
        assert_eq!(
            text(vk::Result::ERROR_OUT_OF_DEVICE_MEMORY),
            "out of device memory in vkGetPhysicalDeviceImageFormatProperties2 for 'sky'"
        );
        assert!(
            text(vk::Result::ERROR_UNKNOWN)
                .contains("vkGetPhysicalDeviceImageFormatProperties2 failed for 'sky'")
        );
    }
}
