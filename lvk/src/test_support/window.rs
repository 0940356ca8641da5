//! What tests make of the presentation engine.

#![allow(missing_docs, reason = "only tests see it")]

use crate::context::Context;
use crate::error::Result;
use crate::handle::SwapchainHandle;
use crate::swapchain::choose::Failure;

/// The presentation engine has lost the surface of a window, as far as the library is told.
pub fn lose_surface(ctx: &Context, swapchain: SwapchainHandle) -> Result<()> {
    let swapchain = ctx.device_state().store.swapchains.get(swapchain)?;
    swapchain.lock().lifecycle.record_present(Err(Failure::SurfaceLost))
}

/// The presentation engine never says that one of the pictures that were presented last is shown, as far as the library is told.
/// Answers whether there is one, and the device could tell.
pub fn stall_present(ctx: &Context, swapchain: SwapchainHandle) -> Result<bool> {
    let swapchain = ctx.device_state().store.swapchains.get(swapchain)?;
    let mut state = swapchain.lock();
    let images = state.resources.current.iter_mut().flat_map(|current| &mut current.images);
    let presented = images.map(|image| &mut image.sync).find(|sync| sync.presented);
    Ok(presented.is_some_and(|sync| {
        sync.stalls = true;
        sync.is_done().is_some()
    }))
}
