//! Failures of the presentation engine, and what each means for a swapchain.

use ash::vk;

use crate::error::{Error, Result};

/// Failure of a call to the presentation engine.
#[derive(Debug, Clone)]
pub(crate) enum Failure {
    /// The swapchain no longer matches its window.
    OutOfDate,
    /// The surface is lost, though the window may still exist.
    SurfaceLost(Error),
    /// Another swapchain, or another program, has the window.
    WindowInUse(Error),
    /// The former surface of the swapchain has the window, because something keeps its images.
    FormerSurface(Error),
    /// An error that a new swapchain does not resolve.
    Other(Error),
}

impl Failure {
    /// Returns the failure for a result of `call` about the swapchain `name`.
    pub(crate) fn from_result(call: &'static str, name: &str) -> impl FnOnce(vk::Result) -> Self {
        move |result| match result {
            vk::Result::ERROR_OUT_OF_DATE_KHR | vk::Result::ERROR_FULL_SCREEN_EXCLUSIVE_MODE_LOST_EXT => {
                Self::OutOfDate
            }
            result => Error::vulkan(call, name)(result).into(),
        }
    }

    /// Returns the error for a caller whose request cannot be repeated.
    pub(crate) fn into_error(self, name: &str) -> Error {
        match self {
            Self::OutOfDate => Error::usage(name, "its window is changing; try again"),
            Self::SurfaceLost(error) => {
                Error::SurfaceLost { swapchain: name.to_owned(), source: Box::new(error) }
            }
            Self::WindowInUse(error) => {
                let message = format!(
                    "its window has another swapchain, or another program draws to it ({error}); destroy that first"
                );
                Error::usage(name, message)
            }
            Self::FormerSurface(error) => {
                Error::usage(name, format!("its window has its former surface ({error}): {KEPT}"))
            }
            Self::Other(error) => error,
        }
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        match &error {
            Error::Vulkan { result: vk::Result::ERROR_SURFACE_LOST_KHR, .. } => Self::SurfaceLost(error),
            Error::Vulkan { result: vk::Result::ERROR_NATIVE_WINDOW_IN_USE_KHR, .. } => {
                Self::WindowInUse(error)
            }
            _ => Self::Other(error),
        }
    }
}

/// Text of an error about a surface that something keeps: the objects that may keep the surface, and the remedy.
const KEPT: &str = "views of its images, or command buffers that were not submitted, keep its surface; drop them before its \
                    window goes or has another surface";

/// Fails if the surface of the swapchain `name` was released and is still there.
pub(crate) fn check_surface_is_gone(name: &str, is_kept: bool) -> Result<()> {
    if is_kept { Err(Error::usage(name, KEPT)) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_mean_another_swapchain_another_surface_or_an_error() {
        let of = |result| Failure::from_result("vkAcquireNextImageKHR", "main window")(result);
        assert!(matches!(of(vk::Result::ERROR_OUT_OF_DATE_KHR), Failure::OutOfDate));
        assert!(matches!(of(vk::Result::ERROR_FULL_SCREEN_EXCLUSIVE_MODE_LOST_EXT), Failure::OutOfDate));
        assert!(matches!(of(vk::Result::ERROR_SURFACE_LOST_KHR), Failure::SurfaceLost(_)));
        assert!(matches!(of(vk::Result::ERROR_NATIVE_WINDOW_IN_USE_KHR), Failure::WindowInUse(_)));
        for result in [vk::Result::ERROR_DEVICE_LOST, vk::Result::ERROR_OUT_OF_HOST_MEMORY] {
            assert!(matches!(of(result), Failure::Other(_)), "{result}");
        }
    }

    #[test]
    fn errors_of_windows_name_the_swapchain_and_the_call() {
        let failed =
            Error::vulkan("vkCreateSwapchainKHR", "main")(vk::Result::ERROR_NATIVE_WINDOW_IN_USE_KHR);
        for (failure, expected) in [
            (Failure::SurfaceLost(failed.clone()), "swapchain 'main': its window is gone"),
            (Failure::WindowInUse(failed.clone()), "main: its window has another swapchain"),
            (Failure::FormerSurface(failed.clone()), "main: its window has its former surface"),
            (Failure::Other(failed.clone()), "vkCreateSwapchainKHR"),
        ] {
            let is_of_window = matches!(failure, Failure::WindowInUse(_) | Failure::FormerSurface(_));
            let error = failure.into_error("main");
            assert_eq!(matches!(error, Error::InvalidUsage { .. }), is_of_window, "{error:?}");
            let told = error.to_string();
            assert!(
                told.starts_with(expected) && told.contains("vkCreateSwapchainKHR failed for 'main'"),
                "{told}"
            );
        }
        let kept = check_surface_is_gone("main", true).unwrap_err().to_string();
        assert!(kept.starts_with("main: ") && kept.contains("not submitted"), "{kept}");
        assert!(check_surface_is_gone("main", false).is_ok());
    }
}
