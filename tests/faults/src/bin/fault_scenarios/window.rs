//! First frames in a window, and frames after the window has changed its size.

use std::ffi::c_void;
use std::num::NonZeroU32;
use std::ptr::NonNull;
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use lvk::raw_window_handle::{
    DisplayHandle, HandleError, HasDisplayHandle, HasWindowHandle, RawDisplayHandle, RawWindowHandle,
    WindowHandle, XcbDisplayHandle, XcbWindowHandle,
};
use lvk::{ColorAttachment, Context, ContextDesc, RenderPassDesc, SwapchainDesc, SwapchainHandle};
use lvk_dev_driver::{DriverRequest, prepare};
use x11rb::connection::Connection;
use x11rb::protocol::composite::{ConnectionExt as _, Redirect};
use x11rb::protocol::xproto::{ConfigureWindowAux, ConnectionExt, CreateWindowAux, ImageFormat, WindowClass};
use x11rb::xcb_ffi::{XCBConnection, load_libxcb};

use crate::{Failure, context};

/// Frames of a colour that are presented before the window is looked at, so that runs make the same calls.
const FRAMES: usize = 3;
/// Times that as many frames are presented at most, until the window shows the colour.
const MOST_TRIES: usize = 20;
/// Time that the window has to show the frames of a try: presents come to the screen in their own time.
const PATIENCE: Duration = Duration::from_secs(2);
/// Frames without an image, one after the other, until the swapchain is given up.
const FRAMES_WITHOUT_IMAGE: usize = 20;
/// Name of the swapchain.
const SWAPCHAIN: &str = "swapchain of the scenario";

struct XWindow {
    connection: &'static XCBConnection,
    screen: usize,
    id: u32,
}

impl Drop for XWindow {
    fn drop(&mut self) {
        // The window ends with the connection at the latest.
        let _ = self.connection.destroy_window(self.id);
        let _ = self.connection.flush();
    }
}

impl HasWindowHandle for XWindow {
    fn window_handle(&self) -> Result<WindowHandle<'_>, HandleError> {
        let id = NonZeroU32::new(self.id).ok_or(HandleError::Unavailable)?;
        // SAFETY: the window lives as long as `self`.
        Ok(unsafe { WindowHandle::borrow_raw(RawWindowHandle::Xcb(XcbWindowHandle::new(id))) })
    }
}

impl HasDisplayHandle for XWindow {
    fn display_handle(&self) -> Result<DisplayHandle<'_>, HandleError> {
        let connection: NonNull<c_void> =
            NonNull::new(self.connection.get_raw_xcb_connection()).ok_or(HandleError::Unavailable)?;
        let raw = XcbDisplayHandle::new(Some(connection), self.screen as i32);
        // SAFETY: the connection lives until the end of the program.
        Ok(unsafe { DisplayHandle::borrow_raw(RawDisplayHandle::Xcb(raw)) })
    }
}

impl XWindow {
    fn open() -> Result<Self, Failure> {
        // The driver brings libxcb along.
        prepare(&DriverRequest::default())?;
        load_libxcb()?;
        static CONNECTION: OnceLock<(XCBConnection, usize)> = OnceLock::new();
        let (connection, screen) = match CONNECTION.get() {
            Some(connected) => connected,
            None => {
                let connected = XCBConnection::connect(None)?;
                CONNECTION.get_or_init(|| connected)
            }
        };
        let id = connection.generate_id()?;
        let root = &connection.setup().roots[*screen];
        let (class, aux) = (WindowClass::INPUT_OUTPUT, CreateWindowAux::new());
        connection.create_window(
            root.root_depth,
            id,
            root.root,
            0,
            0,
            64,
            48,
            0,
            class,
            root.root_visual,
            &aux,
        )?;
        // Windows of other processes on the same display may cover this one: its pixels are kept apart.
        connection.composite_query_version(0, 4)?.reply()?;
        connection.composite_redirect_window(id, Redirect::AUTOMATIC)?;
        connection.map_window(id)?;
        let window = Self { connection, screen: *screen, id };
        window.sync()?;
        Ok(window)
    }

    /// Waits until the server has processed all requests.
    fn sync(&self) -> Result<(), Failure> {
        self.connection.get_input_focus()?.reply()?;
        Ok(())
    }

    fn pixel(&self) -> Result<[u8; 3], Failure> {
        let image = self.connection.get_image(ImageFormat::Z_PIXMAP, self.id, 3, 3, 1, 1, u32::MAX)?;
        let data = image.reply()?.data;
        Ok([data[2], data[1], data[0]])
    }
}

/// Shows a colour, resizes the window, and shows another. Returns both as the window shows them.
pub(crate) fn frames_and_resize() -> Result<Vec<u8>, Failure> {
    let window = Arc::new(XWindow::open()?);
    let ctx = context(ContextDesc { window: Some(window.clone()), ..Default::default() })?;
    let swapchain = ctx.create_swapchain(&SwapchainDesc {
        extent: [64, 48],
        debug_name: SWAPCHAIN,
        ..Default::default()
    })?;
    let first = show(&ctx, *swapchain, &window, [1.0, 0.0, 0.0, 1.0])?;
    let size = ConfigureWindowAux::new().width(80).height(60);
    window.connection.configure_window(window.id, &size)?;
    window.sync()?;
    ctx.resize_swapchain(*swapchain, [80, 60])?;
    let second = show(&ctx, *swapchain, &window, [0.0, 0.0, 1.0, 1.0])?;
    ctx.wait_idle()?;
    Ok([first, second].concat())
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
        (0..FRAMES).try_for_each(|_| present(ctx, swapchain, color))?;
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

/// Presents a frame of the colour, the next that has an image.
fn present(ctx: &Context, swapchain: SwapchainHandle, color: [f32; 4]) -> Result<(), Failure> {
    for _ in 0..FRAMES_WITHOUT_IMAGE {
        ctx.next_frame()?;
        let Some(image) = ctx.next_image(swapchain)? else { continue };
        let mut cmd = ctx.acquire_command_buffer()?;
        let target = [ColorAttachment::clear(image.texture(), color)];
        drop(cmd.begin_rendering(&RenderPassDesc { color: &target, ..Default::default() })?);
        ctx.present(cmd, image)?;
        return Ok(());
    }
    Err(format!("the swapchain '{SWAPCHAIN}' stays out of date: {FRAMES_WITHOUT_IMAGE} frames have no image")
        .into())
}
