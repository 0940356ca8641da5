//! Documented fallbacks: failures after which the library goes on in silence, with the right result.

use crate::fault::FaultError;

/// A command whose failure the library has another way for.
#[derive(Debug)]
pub struct Fallback {
    /// The command.
    pub command: &'static str,
    /// Errors of it after which the library goes on.
    pub errors: &'static [FaultError],
    /// What the library does instead.
    pub instead: Instead,
}

/// What the library does in place of a call that has failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instead {
    /// A further call of the command, for the same object or another one that serves as well.
    CallsAgain,
    /// An allocation of a block of another size, which may also serve objects for which a run without the failure allocates another
    /// block: so there may be no more calls in all, but one follows at once.
    AllocatesAgain,
    /// A question about the progress of work that is asked again later.
    AsksAgain,
    /// The end of a swapchain asks whether its presents have ended.
    AsksForPresents,
    /// The command buffer that was to be begun ahead is begun by the next acquisition, or not needed.
    BeginsLater,
    /// The end of a context learns in another way that its work has ended.
    WaitsOtherwise,
    /// The next frame has a new swapchain.
    RemakesSwapchain,
    /// An object has no name in tools.
    LosesName,
}

use FaultError::{DeviceLost, DeviceMemory, HostMemory, NoAddress, OutOfDate, SurfaceLost};
use Instead::{
    AllocatesAgain, AsksAgain, AsksForPresents, BeginsLater, CallsAgain, LosesName, RemakesSwapchain,
    WaitsOtherwise,
};

const fn fallback(command: &'static str, errors: &'static [FaultError], instead: Instead) -> Fallback {
    Fallback { command, errors, instead }
}

/// Every fallback. The table in `docs/reliability.md` says what the library does.
pub const FALLBACKS: &[Fallback] = &[
    fallback("vkCreateCommandPool", &[HostMemory, DeviceMemory], BeginsLater),
    fallback("vkAllocateCommandBuffers", &[HostMemory, DeviceMemory], BeginsLater),
    fallback("vkResetCommandPool", &[HostMemory, DeviceMemory], BeginsLater),
    fallback("vkBeginCommandBuffer", &[HostMemory, DeviceMemory], BeginsLater),
    fallback("vkAllocateMemory", &[HostMemory, DeviceMemory], AllocatesAgain),
    fallback("vkCreateBuffer", &[DeviceMemory], CallsAgain),
    fallback("vkBindBufferMemory", &[DeviceMemory], CallsAgain),
    fallback("vkMapMemory", &[HostMemory, DeviceMemory, NoAddress], CallsAgain),
    fallback("vkCreateAccelerationStructureKHR", &[DeviceMemory], CallsAgain),
    fallback("vkQueueWaitIdle", &[HostMemory, DeviceMemory, DeviceLost], WaitsOtherwise),
    fallback("vkGetSemaphoreCounterValue", &[HostMemory, DeviceMemory], AsksAgain),
    fallback("vkWaitForFences", &[HostMemory, DeviceMemory], AsksForPresents),
    fallback("vkGetFenceStatus", &[HostMemory, DeviceMemory], AsksAgain),
    fallback("vkSetDebugUtilsObjectNameEXT", &[HostMemory, DeviceMemory], LosesName),
    fallback("vkGetPhysicalDeviceSurfaceCapabilitiesKHR", &[SurfaceLost], CallsAgain),
    fallback("vkGetPhysicalDeviceSurfaceCapabilities2KHR", &[SurfaceLost], CallsAgain),
    fallback("vkGetPhysicalDeviceSurfaceFormatsKHR", &[SurfaceLost], CallsAgain),
    fallback("vkGetPhysicalDeviceSurfacePresentModesKHR", &[SurfaceLost], CallsAgain),
    fallback("vkCreateSwapchainKHR", &[SurfaceLost], CallsAgain),
    fallback("vkAcquireNextImageKHR", &[SurfaceLost, OutOfDate], RemakesSwapchain),
    fallback("vkQueuePresentKHR", &[SurfaceLost, OutOfDate], RemakesSwapchain),
];

/// Returns what the library may do in silence after this error of the command.
#[must_use]
pub fn documented(command: &str, error: FaultError) -> Option<Instead> {
    let fallback = FALLBACKS.iter().find(|fallback| fallback.command == command)?;
    fallback.errors.contains(&error).then_some(fallback.instead)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    const PAGE: &str = include_str!("../../../../docs/reliability.md");

    /// Returns the commands and errors of the table of fallbacks.
    fn page() -> BTreeSet<(String, &'static str)> {
        let (_, section) =
            PAGE.split_once("| command that fails | errors | what the library does |\n").unwrap();
        let lines = section.lines().skip(1).take_while(|line| line.starts_with('|'));
        lines.flat_map(entries).collect()
    }

    fn entries(line: &str) -> Vec<(String, &'static str)> {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let [_, commands, errors, way, _] = cells[..] else { panic!("three cells: {line}") };
        assert!(!way.is_empty(), "{line}");
        let errors: Vec<_> =
            FaultError::ALL.into_iter().filter(|error| errors.contains(title(*error))).collect();
        let commands = commands.split('`').skip(1).step_by(2);
        commands.flat_map(|command| errors.iter().map(|error| (command.to_owned(), error.name()))).collect()
    }

    /// Returns the words of the page for an error.
    fn title(error: FaultError) -> &'static str {
        match error {
            FaultError::HostMemory => "host memory",
            FaultError::DeviceMemory => "device memory",
            FaultError::DeviceLost => "device lost",
            FaultError::SurfaceLost => "surface lost",
            FaultError::OutOfDate => "out of date",
            FaultError::WindowInUse => "window in use",
            FaultError::NoAddress => "no address",
        }
    }

    #[test]
    fn the_page_has_every_fallback_and_no_other() {
        let of = |fallback: &Fallback| {
            let command = fallback.command.to_owned();
            fallback.errors.iter().map(move |error| (command.clone(), error.name())).collect::<Vec<_>>()
        };
        let known: BTreeSet<_> = FALLBACKS.iter().flat_map(of).collect();
        assert_eq!(page(), known);
        assert_eq!(documented("vkBeginCommandBuffer", HostMemory), Some(BeginsLater));
        assert_eq!(documented("vkCreateBuffer", DeviceMemory), Some(CallsAgain));
        assert_eq!(documented("vkCreateBuffer", HostMemory), None);
        assert_eq!(documented("vkCreateImage", HostMemory), None);
    }
}
