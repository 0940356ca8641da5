//! The names of `window.rs` in a build without the feature `window`: the types of a window have no values.

use std::convert::Infallible;
use std::ffi::CStr;
use std::iter::Empty;

use crate::error::Result;
use crate::gpu::caps::optional_features::{FeatureSet, OF_WINDOWS};

/// A window while an instance and a device are made: there is none.
pub(crate) type WindowRef<'a> = &'a Infallible;

/// The extensions of an instance that knows windows: no instance does.
pub(crate) enum WindowExtensions {}

impl WindowExtensions {
    pub(crate) fn query(window: WindowRef<'_>, _: &dyn Fn(&CStr) -> bool) -> Result<Self> {
        match *window {}
    }

    pub(crate) fn names(&self) -> Empty<&'static CStr> {
        match *self {}
    }

    /// The features of a device for windows that cannot be enabled: all of them.
    pub(crate) fn unavailable_features(extensions: Option<&Self>) -> FeatureSet {
        match extensions {
            None => OF_WINDOWS.into_iter().collect(),
            Some(extensions) => match *extensions {},
        }
    }
}
