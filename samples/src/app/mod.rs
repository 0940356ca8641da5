//! What the samples share around a frame: command line, device, frames, pictures, measures, timings and progress.
//!
//! [`sample`] tells what a sample is and how its program is written.

pub(crate) mod array_buffer;
pub mod caches;
pub mod cli;
pub mod device;
pub mod fly_camera;
pub mod frame;
pub mod frame_name;
pub mod frames;
pub mod headless;
pub mod hot_reload;
pub mod interrupt;
pub(crate) mod library_warnings;
pub mod loading;
pub mod metrics;
pub mod pass_times;
pub mod png;
pub mod progress;
pub mod ray_args;
pub mod run_args;
pub mod run_error;
pub mod sample;
pub mod scene_args;
pub mod scene_list;
pub(crate) mod scene_textures;
pub mod screenshot;
pub mod sequence;
pub mod timings;
pub mod ui;
mod window;

use std::io::Write as _;

/// Prints to standard output. A reader that has gone, as that of `hybrid | head -1`, does not cost the picture.
pub(crate) fn print_line(text: &str) {
    let _ = writeln!(std::io::stdout(), "{text}");
}
