//! The GPU time of a child process, by the Vulkan layer of `lvk-gpu-timer`.

use std::io;

use lvk_gpu_timer::{NOT_TIMED, TAKE_BUSY_TIME};
use lvk_layer::{LayerDescription, LayerFolder};

use super::peer::Failure;

/// The variable that names the layer's library. It enables the layer too.
const LIBRARY_VARIABLE: &str = "LVK_GPU_TIMER";

/// Describes the layer to the Vulkan loader.
///
/// # Errors
/// The library is not beside this program, or the folder cannot be written.
pub(super) fn timer_layer() -> io::Result<LayerFolder> {
    LayerFolder::new(&LayerDescription {
        name: "VK_LAYER_LVK_gpu_timer",
        description: "Times submissions",
        library: "lvk_gpu_timer",
        enabled_by: LIBRARY_VARIABLE,
        disabled_by: "LVK_NO_GPU_TIMER",
        pre_instance_functions: &[],
    })
}

/// Returns the milliseconds in which the GPU worked for this process since the last call. `None` if nothing was submitted.
///
/// # Errors
/// There is no layer, the library that the environment names is not that of the layer, or a submission has no timestamps.
pub(super) fn take_busy_time() -> Result<Option<f64>, Failure> {
    let path = std::env::var_os(LIBRARY_VARIABLE).ok_or("no layer measures the time of the GPU")?;
    // SAFETY: the loader has opened the library, and its function has this type.
    let milliseconds = unsafe {
        let library = libloading::Library::new(path)?;
        let take = library.get::<extern "C" fn() -> f64>(TAKE_BUSY_TIME.as_bytes())?;
        take()
    };
    if milliseconds == NOT_TIMED {
        return Err("a queue has no timestamps".into());
    }
    Ok((milliseconds >= 0.0).then_some(milliseconds))
}
