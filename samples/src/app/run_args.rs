//! The part of the command line that all samples share.

use std::path::{Path, PathBuf};

use clap::builder::{PossibleValuesParser, TypedValueParser as _};
use clap::{Args, ValueEnum};
use lvk::DeviceProfile;

use super::frames::Frames;

/// Largest width and height of a picture, in pixels.
pub const MAX_SIZE: u32 = 16_384;

/// Arguments that all samples share: frames, pictures and device.
#[derive(Debug, Clone, PartialEq, Args)]
pub struct RunArgs {
    /// A number: render the first frame that many times and time it [default: 60, or 1 on a driver that runs on the CPU and
    /// for frames of more than 16 steps].
    /// A range as 0..240, without its end: render each frame once as its own picture
    #[arg(long, value_name = "N|FIRST..END", help_heading = "Frames")]
    pub frames: Option<Frames>,

    /// Frames until the animation repeats, at 30 per second
    #[arg(long, value_name = "N", default_value_t = 240)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=i64::from(Frames::MAX_COUNT)))]
    #[arg(help_heading = "Frames")]
    pub round: u32,

    /// Leave out the frames of a sequence whose pictures exist
    #[arg(long, requires = "frames", help_heading = "Frames")]
    pub resume: bool,

    /// Width of the picture in pixels, 1 to 16384
    #[arg(long, value_name = "PIXELS", default_value_t = 1280)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SIZE)), help_heading = "Output")]
    pub width: u32,

    /// Height of the picture in pixels, 1 to 16384
    #[arg(long, value_name = "PIXELS", default_value_t = 720)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SIZE)), help_heading = "Output")]
    pub height: u32,

    /// PNG to write; an existing file is replaced. For a sequence, with # for each digit of the frame's number
    /// [default: the sample's name, in this folder]
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub out: Option<PathBuf>,

    /// Show the sample in a window instead of writing pictures; mouse and keys move the camera. With --frames N the window
    /// closes after N frames, each a 30th of a second of the animation however long it takes (none while Space pauses it). With
    /// --out the last frame is written as the window shows it
    #[arg(long, conflicts_with = "resume", help_heading = "Window")]
    pub window: bool,

    /// Give the window another size after its first frame, and go on once window and pictures have it, so that a run with a resize
    /// repeats to the Vulkan call
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = size, requires = "window", requires = "frames", hide = true)]
    pub resized: Option<[u32; 2]>,

    /// Read shaders from a folder like `shaders`, and compile them again when one changes
    #[arg(long, value_name = "FOLDER", num_args = 0..=1, default_missing_value = "shaders")]
    #[arg(requires = "window", help_heading = "Window")]
    pub hot_reload: Option<PathBuf>,

    /// Device to use, by its number in --list-devices or part of its name
    /// [default: the most capable one]
    #[arg(long, value_name = "NUMBER|NAME", help_heading = "Device")]
    pub device: Option<String>,

    /// Emulate a device profile on this device: disable missing features and clamp limits
    #[arg(
        long,
        value_name = "NAME",
        value_parser = PossibleValuesParser::new(DeviceProfile::names()).try_map(|name| DeviceProfile::named(&name)),
        help_heading = "Device"
    )]
    pub profile: Option<DeviceProfile>,

    /// Use no caches of compiled shaders, pipelines, software BVHs and acceleration structures. They are otherwise in the folder
    /// of LVK_CACHE, or in lvk in the user's folder for caches
    #[arg(long, help_heading = "Device")]
    pub no_cache: bool,

    /// Folder of the caches, instead of the folders that --no-cache names
    #[arg(long, value_name = "FOLDER", conflicts_with = "no_cache", help_heading = "Device")]
    pub cache: Option<PathBuf>,

    /// Print the devices and their ray tracing support, and exit
    #[arg(long, help_heading = "Device")]
    pub list_devices: bool,

    /// Run with Vulkan validation; a message is an error
    #[arg(long, value_enum, value_name = "KIND", num_args = 0..=1, require_equals = true, default_missing_value = "core")]
    #[arg(help_heading = "Device")]
    pub validate: Option<ValidationArg>,

    /// Check what shaders take from bindless arrays: wrong indices, and textures that commands do not declare, are errors. Slow
    #[arg(long, help_heading = "Device")]
    pub check_indices: bool,
}

/// Parses `640x480`.
fn size(text: &str) -> Result<[u32; 2], String> {
    let side = |text: &str| text.parse().ok().filter(|side| (1..=MAX_SIZE).contains(side));
    text.split_once('x')
        .and_then(|(width, height)| Some([side(width)?, side(height)?]))
        .ok_or_else(|| format!("write a size as 640x480, 1 to {MAX_SIZE} pixels each way"))
}

impl RunArgs {
    /// Returns the output file of images of the sample called `name`.
    #[must_use]
    pub fn out_or(&self, name: &str) -> PathBuf {
        let is_sequence = matches!(self.frames, Some(Frames::Sequence(_)));
        let file = if is_sequence { format!("{name}_####.png") } else { format!("{name}.png") };
        self.out.clone().unwrap_or_else(|| Path::new(&file).to_owned())
    }

    /// Returns the width and height of the pictures.
    #[must_use]
    pub fn extent(&self) -> [u32; 2] {
        [self.width, self.height]
    }
}

/// The kind of Vulkan validation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ValidationArg {
    /// Correct use and synchronisation.
    Core,
    /// As `core`, and accesses of shaders on the device; slow.
    Gpu,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_has_two_sides_of_a_picture() {
        assert_eq!(size("640x480"), Ok([640, 480]));
        assert_eq!(size("1x16384"), Ok([1, 16_384]));
        for bad in ["", "640", "x", "0x480", "640x16385", "640x480x2", "-1x2", "a x b"] {
            assert!(size(bad).is_err(), "{bad}");
        }
    }
}
