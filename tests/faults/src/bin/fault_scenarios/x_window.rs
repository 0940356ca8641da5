//! A window of an X server, whose pixels can be read.

use std::ffi::c_void;
use std::num::NonZeroU32;
use std::ptr::NonNull;
use std::sync::OnceLock;

use lvk::raw_window_handle::{
    DisplayHandle, HandleError, HasDisplayHandle, HasWindowHandle, RawDisplayHandle, RawWindowHandle,
    WindowHandle, XcbDisplayHandle, XcbWindowHandle,
};
use lvk_dev_driver::{DriverRequest, prepare};
use x11rb::connection::Connection;
use x11rb::protocol::composite::{ConnectionExt as _, Redirect};
use x11rb::protocol::xproto::{ConfigureWindowAux, ConnectionExt, CreateWindowAux, ImageFormat, WindowClass};
use x11rb::xcb_ffi::{XCBConnection, load_libxcb};

use crate::Failure;

/// A window of 64 x 48 pixels. It closes on drop.
pub(crate) struct XWindow {
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
    /// Opens a window and shows it.
    pub(crate) fn open() -> Result<Self, Failure> {
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

    /// Changes the size, in pixels.
    pub(crate) fn resize(&self, [width, height]: [u32; 2]) -> Result<(), Failure> {
        let size = ConfigureWindowAux::new().width(width).height(height);
        self.connection.configure_window(self.id, &size)?;
        self.sync()
    }

    /// Returns the colour of a pixel near the upper left corner.
    pub(crate) fn pixel(&self) -> Result<[u8; 3], Failure> {
        let image = self.connection.get_image(ImageFormat::Z_PIXMAP, self.id, 3, 3, 1, 1, u32::MAX)?;
        let data = image.reply()?.data;
        Ok([data[2], data[1], data[0]])
    }
}
