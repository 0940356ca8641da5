//! Stand-in for `window.rs` in a build without the feature `window`. The types have no values.

use std::convert::Infallible;
use std::ffi::CStr;
use std::iter::Empty;

use crate::error::Result;
use crate::gpu::caps::optional_features::{FeatureSet, OF_WINDOWS};

/// Stand-in for a window; never constructed.
pub(crate) type WindowRef<'a> = &'a Infallible;

/// Stand-in for the instance extensions of windows; never constructed.
pub(crate) enum WindowExtensions {}

impl WindowExtensions {
    pub(crate) fn query(window: WindowRef<'_>, _: &dyn Fn(&CStr) -> bool) -> Result<Self> {
        match *window {}
    }

    /// Returns `None`: without the feature `window` the library creates no surfaces.
    pub(super) fn enabled(_: &[&CStr]) -> Option<Self> {
        None
    }

    pub(crate) fn missing(_: Option<&Self>, window: WindowRef<'_>) -> Result<Option<&'static CStr>> {
        match *window {}
    }

    pub(crate) fn names(&self) -> Empty<&'static CStr> {
        match *self {}
    }

    /// Returns the presentation features of a device that cannot be enabled: all of them.
    pub(crate) fn unavailable_features(extensions: Option<&Self>) -> FeatureSet {
        match extensions {
            None => OF_WINDOWS.into_iter().collect(),
            Some(extensions) => match *extensions {},
        }
    }
}
