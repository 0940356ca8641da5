//! Windows that no surface can be made for.
#![expect(clippy::unwrap_used, reason = "a test whose set-up fails has failed")]

use std::sync::Arc;

use lvk::raw_window_handle::{
    DisplayHandle, HandleError, HasDisplayHandle, HasWindowHandle, RawDisplayHandle, RawWindowHandle,
    WebDisplayHandle, WebWindowHandle, WindowHandle, XcbDisplayHandle, XcbWindowHandle,
};
use lvk::{Error, WindowHandles};

/// The mistake of a window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Strange {
    /// The window library answers no handle.
    WithoutHandle,
    /// Vulkan has no surfaces for the window system.
    OfUnknownSystem,
    /// The display is of another window system than the window.
    OfTwoSystems,
    /// The display has no connection to its server.
    WithoutConnection,
}

impl HasDisplayHandle for Strange {
    fn display_handle(&self) -> Result<DisplayHandle<'_>, HandleError> {
        let raw = match self {
            Self::WithoutHandle => return Err(HandleError::Unavailable),
            Self::OfUnknownSystem => RawDisplayHandle::Web(WebDisplayHandle::new()),
            _ => RawDisplayHandle::Xcb(XcbDisplayHandle::new(None, 0)),
        };
        // SAFETY: the handle names nothing.
        Ok(unsafe { DisplayHandle::borrow_raw(raw) })
    }
}

impl HasWindowHandle for Strange {
    fn window_handle(&self) -> Result<WindowHandle<'_>, HandleError> {
        let raw = match self {
            Self::WithoutHandle => return Err(HandleError::Unavailable),
            Self::WithoutConnection => RawWindowHandle::Xcb(XcbWindowHandle::new(1.try_into().unwrap())),
            _ => RawWindowHandle::Web(WebWindowHandle::new(1)),
        };
        // SAFETY: nothing is done with the window: there is no connection to its server.
        Ok(unsafe { WindowHandle::borrow_raw(raw) })
    }
}

/// Returns a window with this mistake.
pub fn window(strange: Strange) -> Option<Arc<dyn WindowHandles>> {
    Some(Arc::new(strange))
}

/// Checks that the error names the window and says what is wrong with it.
///
/// # Panics
/// If it does not.
pub fn expect_refused(strange: Strange, error: &Error) {
    let text = error.to_string();
    let (is_kind, words) = match strange {
        Strange::WithoutHandle => {
            (matches!(error, Error::InvalidUsage { .. }), "window: the window has no handle")
        }
        Strange::OfUnknownSystem => {
            (matches!(error, Error::Unsupported { .. }), "this kind of window: Vulkan has no surfaces")
        }
        Strange::OfTwoSystems => (matches!(error, Error::InvalidUsage { .. }), "different window systems"),
        Strange::WithoutConnection => (matches!(error, Error::InvalidUsage { .. }), "names no display"),
    };
    assert!(is_kind && text.contains(words), "{strange:?}: {text}");
}
