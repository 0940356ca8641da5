//! Test hooks for failures of the presentation engine.

#![allow(missing_docs, reason = "only tests see it")]

use ash::vk;

use crate::context::Context;
use crate::error::Result;
use crate::handle::SwapchainHandle;
use crate::swapchain::failure::Failure;

/// Makes the library believe that the presentation engine has lost the surface of a window.
pub fn lose_surface(ctx: &Context, swapchain: SwapchainHandle) -> Result<()> {
    let swapchain = ctx.device_state().store.swapchains.get(swapchain)?;
    let lost = Failure::from_result("vkQueuePresentKHR", "window")(vk::Result::ERROR_SURFACE_LOST_KHR);
    swapchain.lock().lifecycle.record_present("window", Err(lost))
}

/// Makes the library believe that the presentation engine never finishes one of the images that were presented last.
///
/// Returns true if there is such an image and the device can report completion.
pub fn stall_present(ctx: &Context, swapchain: SwapchainHandle) -> Result<bool> {
    let swapchain = ctx.device_state().store.swapchains.get(swapchain)?;
    let mut state = swapchain.lock();
    let images = state.resources.current.iter_mut().flat_map(|current| &mut current.images);
    let presented = images.map(|image| &mut image.sync).find(|sync| sync.presented);
    Ok(presented.is_some_and(|sync| {
        sync.stalls = true;
        sync.reports_completion()
    }))
}
