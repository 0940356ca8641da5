//! Windows for tests, on an X server of their own without a screen.
#![expect(clippy::expect_used, clippy::panic, reason = "a test whose X server fails has failed")]

use std::ffi::c_void;
use std::num::NonZeroU32;
use std::ptr::NonNull;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, OnceLock};

use lvk::raw_window_handle::{
    DisplayHandle, HandleError, HasDisplayHandle, HasWindowHandle, RawDisplayHandle, RawWindowHandle,
    WindowHandle, XcbDisplayHandle, XcbWindowHandle,
};
use lvk::{
    ColorAttachment, CommandBuffer, Context, RenderPassDesc, Result, SubmitHandle, SwapchainHandle,
    TextureHandle,
};
use lvk_dev_driver::{VirtualDisplay, virtual_display};
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{ConfigureWindowAux, ConnectionExt, CreateWindowAux, ImageFormat, WindowClass};
use x11rb::xcb_ffi::{XCBConnection, load_libxcb};

use crate::device::{draws_to_virtual_displays, fetched, unavailable, vulkan};

/// The X server of the test program, with a connection that keeps it running.
pub struct Desktop {
    connection: XCBConnection,
    screen: usize,
    _server: VirtualDisplay,
}

/// Side in pixels of the area of one window.
pub const ROOM: u32 = 200;

/// Areas side by side.
const COLUMNS: u32 = 10;

/// Returns the desktop of this program. Prints a line and returns `None` where there is no X server and none can be
/// fetched, and where the driver does not draw to it.
///
/// # Panics
/// When there is none although `LVK_REQUIRE_GPU=1` demands every test.
pub fn desktop() -> Option<&'static Desktop> {
    static DESKTOP: OnceLock<Option<Desktop>> = OnceLock::new();
    DESKTOP.get_or_init(Desktop::new).as_ref()
}

/// Starts an X server for programs that a test starts. Prints a line and returns `None` where there is none and none
/// can be fetched, and where the driver does not draw to it.
///
/// # Panics
/// As [`desktop`].
pub fn display() -> Option<VirtualDisplay> {
    if !draws_to_virtual_displays() {
        return None;
    }
    fetched(virtual_display(), "X server for windows")
}

impl Desktop {
    fn new() -> Option<Self> {
        // The driver brings libxcb along.
        vulkan()?;
        let server = display()?;
        if let Err(error) = load_libxcb() {
            unavailable(&format!("libxcb cannot be opened: {error}"));
        }
        let (connection, screen) =
            XCBConnection::connect(Some(&c_string(server.name()))).expect("the X server has just started");
        Some(Self { connection, screen, _server: server })
    }

    /// Opens a visible window of at most [`ROOM`] pixels a side. The first windows do not overlap, as a screen
    /// forgets hidden pixels.
    pub fn window(&'static self, extent: [u32; 2]) -> Arc<TestWindow> {
        static WINDOWS: AtomicU32 = AtomicU32::new(0);
        let place = WINDOWS.fetch_add(1, Ordering::Relaxed);
        let screen = &self.connection.setup().roots[self.screen];
        let id = self.connection.generate_id().expect("ids do not run out");
        let [width, height] = extent.map(|side| side as u16);
        self.connection
            .create_window(
                screen.root_depth,
                id,
                screen.root,
                (place % COLUMNS * ROOM) as i16,
                (place / COLUMNS * ROOM % u32::from(screen.height_in_pixels)) as i16,
                width,
                height,
                0,
                WindowClass::INPUT_OUTPUT,
                screen.root_visual,
                &CreateWindowAux::new(),
            )
            .expect("the connection is up");
        self.connection.map_window(id).expect("the connection is up");
        self.sync();
        Arc::new(TestWindow { desktop: self, id })
    }

    /// Waits until the server has processed all requests.
    fn sync(&self) {
        let reply = self.connection.get_input_focus().expect("the connection is up").reply();
        reply.expect("the server answers");
    }
}

/// A window, closed on drop.
pub struct TestWindow {
    desktop: &'static Desktop,
    id: u32,
}

impl TestWindow {
    /// Resizes the window at once.
    pub fn resize(&self, extent: [u32; 2]) {
        let size = ConfigureWindowAux::new().width(extent[0]).height(extent[1]);
        self.desktop.connection.configure_window(self.id, &size).expect("the connection is up");
        self.desktop.sync();
    }

    /// Closes the window although it is still in use.
    pub fn close(&self) {
        self.desktop.connection.destroy_window(self.id).expect("the connection is up");
        self.desktop.sync();
    }

    /// Returns red, green and blue of a pixel of the window.
    pub fn pixel(&self, x: i16, y: i16) -> [u8; 3] {
        let image = self.desktop.connection.get_image(ImageFormat::Z_PIXMAP, self.id, x, y, 1, 1, u32::MAX);
        let data = image.expect("the connection is up").reply().expect("the pixel lies in the window").data;
        [data[2], data[1], data[0]]
    }
}

impl Drop for TestWindow {
    fn drop(&mut self) {
        // It may be closed already.
        let _ = self.desktop.connection.destroy_window(self.id);
        let _ = self.desktop.connection.flush();
    }
}

impl HasWindowHandle for TestWindow {
    fn window_handle(&self) -> std::result::Result<WindowHandle<'_>, HandleError> {
        let id = NonZeroU32::new(self.id).ok_or(HandleError::Unavailable)?;
        let raw = RawWindowHandle::Xcb(XcbWindowHandle::new(id));
        // SAFETY: the window lives as long as `self`, unless a test closes it, which X servers take.
        Ok(unsafe { WindowHandle::borrow_raw(raw) })
    }
}

impl HasDisplayHandle for TestWindow {
    fn display_handle(&self) -> std::result::Result<DisplayHandle<'_>, HandleError> {
        let connection: NonNull<c_void> =
            NonNull::new(self.desktop.connection.get_raw_xcb_connection()).ok_or(HandleError::Unavailable)?;
        let raw = XcbDisplayHandle::new(Some(connection), self.desktop.screen as i32);
        // SAFETY: the connection lives until the end of the program.
        Ok(unsafe { DisplayHandle::borrow_raw(RawDisplayHandle::Xcb(raw)) })
    }
}

/// Records a pass that fills the texture with a colour.
///
/// # Errors
/// Those of the library.
pub fn fill(ctx: &Context, texture: TextureHandle, color: [f32; 4]) -> Result<CommandBuffer> {
    let mut cmd = ctx.acquire_command_buffer()?;
    let target = ColorAttachment::clear(texture, color);
    drop(cmd.begin_rendering(&RenderPassDesc { color: &[target], ..Default::default() })?);
    Ok(cmd)
}

/// Presents a frame of one colour; `None` where nothing could be shown.
///
/// # Errors
/// Those of the library.
pub fn present_color(
    ctx: &Context,
    swapchain: SwapchainHandle,
    color: [f32; 4],
) -> Result<Option<SubmitHandle>> {
    let Some(image) = ctx.next_image(swapchain)? else { return Ok(None) };
    let cmd = fill(ctx, image.texture(), color)?;
    ctx.present(cmd, image).map(Some)
}

/// Shows frames until the window has the colour: presents come to the screen in their own time.
///
/// # Panics
/// When the window does not show it after 200 frames.
pub fn present_until_visible(
    ctx: &Context,
    swapchain: SwapchainHandle,
    window: &TestWindow,
    color: [f32; 4],
) {
    let wanted = [color[0], color[1], color[2]].map(|part| (part * 255.0) as u8);
    for _ in 0..200 {
        present_color(ctx, swapchain, color).expect("the frame is presented");
        ctx.wait_idle().expect("the frame is presented");
        if window.pixel(3, 2) == wanted {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    panic!("the window shows {:?}, not {wanted:?}", window.pixel(3, 2));
}

fn c_string(text: &str) -> std::ffi::CString {
    std::ffi::CString::new(text).expect("names of displays have no zero bytes")
}
