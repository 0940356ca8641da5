//! Frames in a window: the first ones, after a resize, behind slow work, and in another window.

use std::sync::Arc;
use std::time::{Duration, Instant};

use lvk::{
    ColorAttachment, Context, ContextDesc, Holder, RenderPassDesc, SwapchainDesc, SwapchainHandle,
    SwapchainImage,
};

use crate::slow_work::SlowWork;
use crate::x_window::XWindow;
use crate::{Failure, context};

/// Frames of a colour that are presented before the window is looked at, so that runs make the same calls.
const FRAMES: usize = 3;
/// Times that as many frames are presented at most, until the window shows the colour.
const MOST_TRIES: usize = 20;
/// Time that the window has to show the frames of a try: presents come to the screen in their own time.
const PATIENCE: Duration = Duration::from_secs(2);
/// Frames without an image, one after the other, until the swapchain is given up.
const FRAMES_WITHOUT_IMAGE: usize = 20;
const RED: [f32; 4] = [1.0, 0.0, 0.0, 1.0];
const BLUE: [f32; 4] = [0.0, 0.0, 1.0, 1.0];
/// Name of the swapchain.
const SWAPCHAIN: &str = "swapchain of the scenario";

/// Returns a window with a context and a swapchain for it.
fn start() -> Result<(Arc<XWindow>, Context, Holder<SwapchainHandle>), Failure> {
    let window = Arc::new(XWindow::open()?);
    let ctx = context(ContextDesc { window: Some(window.clone()), ..Default::default() })?;
    let desc = SwapchainDesc { extent: [64, 48], debug_name: SWAPCHAIN, ..Default::default() };
    let swapchain = ctx.create_swapchain(&desc)?;
    Ok((window, ctx, swapchain))
}

/// Shows a colour, resizes the window, and shows another. Returns both as the window shows them.
pub(crate) fn frames_and_resize() -> Result<Vec<u8>, Failure> {
    let (window, ctx, swapchain) = start()?;
    let first = show(&ctx, *swapchain, &window, RED)?;
    window.resize([80, 60])?;
    ctx.resize_swapchain(*swapchain, [80, 60])?;
    let second = show(&ctx, *swapchain, &window, BLUE)?;
    ctx.wait_idle()?;
    Ok([first, second].concat())
}

/// Presents behind slow work, resizes while an image is acquired, and goes on in another window, as after a pause on Android, which comes
/// while a frame waits to be shown. Returns the colours that both windows show.
pub(crate) fn another_window() -> Result<Vec<u8>, Failure> {
    let (window, ctx, swapchain) = start()?;
    let slow = SlowWork::new(&ctx, Duration::from_millis(60))?;
    present(&ctx, *swapchain, RED, Some(&slow))?;
    ctx.wait_idle()?;
    let first = show(&ctx, *swapchain, &window, RED)?;
    // This image is never presented.
    ctx.next_image(*swapchain)?;
    window.resize([80, 60])?;
    ctx.resize_swapchain(*swapchain, [80, 60])?;
    // The suspension meets a present that waits for work of the GPU, and an image that is never presented.
    present(&ctx, *swapchain, BLUE, Some(&slow))?;
    ctx.next_image(*swapchain)?;
    // An application that is paused lets its window go only if the surface is gone, and so asks again.
    ctx.suspend_swapchain(*swapchain).or_else(|error| {
        eprintln!("warning: the surface stays, and is asked for again: {error}");
        ctx.suspend_swapchain(*swapchain)
    })?;
    drop(window);
    let window = Arc::new(XWindow::open()?);
    ctx.resume_swapchain(*swapchain, &(window.clone() as Arc<_>), [64, 48])?;
    let second = show(&ctx, *swapchain, &window, BLUE)?;
    ctx.wait_idle()?;
    Ok([first, second].concat())
}

/// Suspends a swapchain while a command buffer keeps its surface, goes on in another window, and then in the first again. Returns the
/// colours that the windows show.
pub(crate) fn kept_surface() -> Result<Vec<u8>, Failure> {
    let (window, ctx, swapchain) = start()?;
    let first = show(&ctx, *swapchain, &window, RED)?;
    let image = next_image(&ctx, *swapchain)?;
    let mut kept = ctx.acquire_command_buffer()?;
    let target = [ColorAttachment::clear(image.texture(), RED)];
    drop(kept.begin_rendering(&RenderPassDesc { color: &target, ..Default::default() })?);
    suspend_with_surface(&ctx, *swapchain)?;
    let other = Arc::new(XWindow::open()?);
    ctx.resume_swapchain(*swapchain, &(other.clone() as Arc<_>), [64, 48])?;
    let second = show(&ctx, *swapchain, &other, BLUE)?;
    suspend_with_surface(&ctx, *swapchain)?;
    ctx.resume_swapchain(*swapchain, &(window.clone() as Arc<_>), [64, 48])?;
    drop(kept);
    let third = show(&ctx, *swapchain, &window, BLUE)?;
    ctx.wait_idle()?;
    Ok([first, second, third].concat())
}

/// Suspends a swapchain, which tells that something keeps its surface.
fn suspend_with_surface(ctx: &Context, swapchain: SwapchainHandle) -> Result<(), Failure> {
    match ctx.suspend_swapchain(swapchain) {
        Err(lvk::Error::InvalidUsage { .. }) => Ok(()),
        Err(error) => Err(error.into()),
        Ok(()) => Err("the suspension does not tell of the surface".into()),
    }
}

/// Presents frames until the window shows the colour.
fn show(
    ctx: &Context,
    swapchain: SwapchainHandle,
    window: &XWindow,
    color: [f32; 4],
) -> Result<[u8; 3], Failure> {
    let wanted = [color[0], color[1], color[2]].map(|part| (part * 255.0) as u8);
    for _ in 0..MOST_TRIES {
        (0..FRAMES).try_for_each(|_| present(ctx, swapchain, color, None))?;
        ctx.wait_idle()?;
        let presented = Instant::now();
        while presented.elapsed() < PATIENCE {
            if window.pixel()? == wanted {
                return Ok(wanted);
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }
    Err(format!("the window never shows {wanted:?}").into())
}

/// Presents a frame of the colour, the next that has an image, behind `slow` work.
fn present(
    ctx: &Context,
    swapchain: SwapchainHandle,
    color: [f32; 4],
    slow: Option<&SlowWork>,
) -> Result<(), Failure> {
    let image = next_image(ctx, swapchain)?;
    let mut cmd = ctx.acquire_command_buffer()?;
    slow.map_or(Ok(()), |slow| slow.record(&mut cmd))?;
    let target = [ColorAttachment::clear(image.texture(), color)];
    drop(cmd.begin_rendering(&RenderPassDesc { color: &target, ..Default::default() })?);
    if let Err(error) = ctx.present(cmd, image) {
        // An application may go on with the next frame, while the GPU is at work on this one.
        let _ = ctx.next_image(swapchain);
        return Err(error.into());
    }
    Ok(())
}

/// Returns the image of the next frame that has one.
fn next_image(ctx: &Context, swapchain: SwapchainHandle) -> Result<SwapchainImage, Failure> {
    for _ in 0..FRAMES_WITHOUT_IMAGE {
        ctx.next_frame()?;
        if let Some(image) = ctx.next_image(swapchain)? {
            return Ok(image);
        }
    }
    Err(format!("the swapchain '{SWAPCHAIN}' stays out of date: {FRAMES_WITHOUT_IMAGE} frames have no image")
        .into())
}
