//! A window in which frames are presented, resized now and then, with a swapchain that is made anew now and then.
#![cfg(target_os = "linux")]

use std::sync::Arc;

use lvk::{Context, Holder, PresentMode, Result, SwapchainDesc, SwapchainHandle};
use lvk_tests::windows::{TestWindow, present_color};

use super::run::Tally;

/// A window and its swapchain.
pub struct Presentation {
    window: Arc<TestWindow>,
    /// None only while it is made anew.
    swapchain: Option<Holder<SwapchainHandle>>,
}

impl Presentation {
    /// Creates the swapchain.
    pub fn new(ctx: &Context, window: Arc<TestWindow>) -> Result<Self> {
        let swapchain = Some(create(ctx, &window)?);
        Ok(Self { window, swapchain })
    }

    /// Presents every tenth frame, resizes every fiftieth, and makes the swapchain anew once in 125 frames.
    pub fn frame(&mut self, ctx: &Context, phase: u32, tally: &mut Tally) -> Result<()> {
        if phase % 125 == 60 {
            // A window has one swapchain at a time.
            self.swapchain = None;
            ctx.wait_idle()?;
            self.swapchain = Some(create(ctx, &self.window)?);
            tally.count("swapchains created and destroyed");
        }
        let Some(swapchain) = self.swapchain.as_deref().copied() else { return Ok(()) };
        if phase % 50 == 20 {
            let extent = [40 + phase / 5, 60 - phase / 10];
            self.window.resize(extent);
            ctx.resize_swapchain(swapchain, extent)?;
            tally.count("swapchain resizes");
        }
        if phase.is_multiple_of(10) && present_color(ctx, swapchain, [0.0, 0.5, 1.0, 1.0])?.is_some() {
            tally.count("presents");
        }
        Ok(())
    }
}

fn create(ctx: &Context, window: &Arc<TestWindow>) -> Result<Holder<SwapchainHandle>> {
    ctx.create_swapchain(&SwapchainDesc {
        window: Some(window.clone()),
        present_modes: &[PresentMode::Immediate, PresentMode::Mailbox],
        debug_name: "soak",
        ..Default::default()
    })
}
