//! Shared by the samples around a frame: command line, device, frames, images, image metrics, timings and progress.
//!
//! [`sample`] defines a sample, [`sample_info`] the description that its program follows from.

pub mod array_buffer;
pub mod caches;
pub mod cli;
pub mod device;
pub(crate) mod file_size_limit;
pub mod fly_camera;
pub mod frame;
pub mod frame_name;
pub mod frames;
pub mod headless;
pub mod input_file;
pub mod interrupt;
pub mod library_warnings;
pub mod loading;
pub mod metrics;
pub mod orbit_camera;
pub mod pass_times;
pub mod png;
pub mod progress;
pub mod ray_args;
pub mod render_target;
pub mod run_args;
pub mod run_error;
pub mod sample;
pub mod sample_error;
pub mod sample_info;
pub mod scene_args;
pub mod scene_list;
pub(crate) mod scene_textures;
pub mod screenshot;
pub mod sequence;
pub(crate) mod summary;
pub mod timings;
pub mod ui;
pub mod value_parsers;
#[cfg(feature = "window")]
mod window;
#[cfg(not(feature = "window"))]
#[path = "no_window.rs"]
mod window;

use std::io::Write as _;

/// Prints a line to standard output. Ignores a closed pipe, as in `hybrid | head -1`, so that the image is still written.
pub(crate) fn print_line(text: &str) {
    let _ = writeln!(std::io::stdout(), "{}", lvk::readable_text(text));
}

/// Returns a count with its noun: "1 message", "2 messages".
pub(crate) fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// Prints a line about `subject`, such as "warning", to standard error, without control characters: texts of drivers and
/// layers may have names in them.
pub(crate) fn print_message(subject: &str, text: impl std::fmt::Display) {
    let _ = writeln!(std::io::stderr(), "{subject}: {}", lvk::readable_text(&text.to_string()));
}
