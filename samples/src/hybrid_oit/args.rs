//! The command line of the `hybrid_oit` sample.

use std::ops::Range;
use std::path::{Path, PathBuf};

use clap::Parser;
use clap::builder::{PossibleValuesParser, TypedValueParser as _};
use lvk::DeviceProfile;

use crate::app::args::{MAX_SIZE, RayTracing, Validation};

/// Frames a second of the animation.
pub(super) const FRAMES_PER_SECOND: f64 = 60.0;

/// Renders blocks and drifting spheres of tinted glass: raster with order-independent transparency, and ray traced
/// coloured shadows.
#[derive(Debug, Clone, PartialEq, Parser)]
#[command(name = "hybrid_oit", version, after_help = EXAMPLES)]
pub struct HybridOitArgs {
    /// How to trace rays
    #[arg(long, value_enum, default_value_t = RayTracing::Auto, help_heading = "Rendering")]
    pub rt: RayTracing,

    /// Samples a pixel along each side, 1 to 4: smooths edges
    #[arg(
        long,
        value_name = "N",
        default_value_t = 2,
        value_parser = clap::value_parser!(u32).range(1..=4),
        help_heading = "Rendering"
    )]
    pub supersampling: u32,

    /// Shadow rays a sample, 1 to 64; a single one gives hard shadows
    #[arg(
        long,
        value_name = "N",
        default_value_t = 4,
        value_parser = clap::value_parser!(u32).range(1..=64),
        help_heading = "Rendering"
    )]
    pub shadow_rays: u32,

    /// Nodes in the pool of the transparency lists; glass that finds none is left out and counted
    /// [default: two a sample]
    #[arg(long, value_name = "N", help_heading = "Rendering")]
    pub nodes: Option<u32>,

    /// Frame to render, at 60 a second
    #[arg(long, value_name = "N", conflicts_with_all = ["frames", "time"], help_heading = "Frames")]
    pub frame: Option<u32>,

    /// Frames to render, as 0..480, without the last; the animation repeats itself after 480
    #[arg(long, value_name = "FIRST..END", value_parser = range, conflicts_with = "time", help_heading = "Frames")]
    pub frames: Option<Range<u32>>,

    /// Moment to render, in seconds [default: 1.9]
    #[arg(long, value_name = "SECONDS", value_parser = seconds, help_heading = "Frames")]
    pub time: Option<f64>,

    /// Width of the picture in pixels
    #[arg(
        long,
        value_name = "PIXELS",
        default_value_t = 1280,
        value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SIZE)),
        help_heading = "Output"
    )]
    pub width: u32,

    /// Height of the picture in pixels
    #[arg(
        long,
        value_name = "PIXELS",
        default_value_t = 720,
        value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SIZE)),
        help_heading = "Output"
    )]
    pub height: u32,

    /// PNG to write; an existing file is replaced. For several frames with # for each digit of the frame's number
    /// [default: hybrid_oit.png, or hybrid_oit_####.png]
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub out: Option<PathBuf>,

    /// Device to use, by its number in --list-devices or part of its name
    /// [default: the most capable one that can trace rays]
    #[arg(long, value_name = "NUMBER|NAME", help_heading = "Device")]
    pub device: Option<String>,

    /// Rehearse another device on this one: without what it lacks, and within its limits
    #[arg(
        long,
        value_name = "NAME",
        value_parser = PossibleValuesParser::new(DeviceProfile::names()).try_map(|name| DeviceProfile::named(&name)),
        help_heading = "Device"
    )]
    pub profile: Option<DeviceProfile>,

    /// Print the devices and what they can do, and exit
    #[arg(long, help_heading = "Device")]
    pub list_devices: bool,

    /// Run with Vulkan validation; a message is an error
    #[arg(
        long,
        value_enum,
        value_name = "KIND",
        num_args = 0..=1,
        default_missing_value = "core",
        help_heading = "Device"
    )]
    pub validate: Option<Validation>,
}

/// A picture to render.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Shot {
    /// Moment in seconds.
    pub(super) seconds: f64,
    /// File to write.
    pub(super) path: PathBuf,
}

impl HybridOitArgs {
    /// The moment without any wish: one that shows every colour of shadow.
    const SHOWN_MOMENT: f64 = 1.9;

    /// What to render, in this order. A message where several pictures would have the same name.
    pub(super) fn shots(&self) -> Result<Vec<Shot>, String> {
        let Some(frames) = &self.frames else {
            let of_frame = |frame: u32| f64::from(frame) / FRAMES_PER_SECOND;
            let seconds = self.frame.map(of_frame).or(self.time).unwrap_or(Self::SHOWN_MOMENT);
            let path = self.out.clone().unwrap_or_else(|| PathBuf::from("hybrid_oit.png"));
            return Ok(vec![Shot { seconds, path: numbered(&path, self.frame.unwrap_or(0)) }]);
        };
        let out = self.out.clone().unwrap_or_else(|| PathBuf::from("hybrid_oit_####.png"));
        if numbered(&out, 0) == out {
            return Err("--frames needs an --out with a place for the number, as frame_####.png".to_owned());
        }
        let shot =
            |frame| Shot { seconds: f64::from(frame) / FRAMES_PER_SECOND, path: numbered(&out, frame) };
        Ok(frames.clone().map(shot).collect())
    }
}

/// The path with the last run of `#` in its file name replaced by a number.
fn numbered(path: &Path, frame: u32) -> PathBuf {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let Some(end) = name.rfind('#').map(|last| last + 1) else { return path.to_owned() };
    let before = name[..end].trim_end_matches('#');
    let digits = end - before.len();
    path.with_file_name(format!("{before}{frame:0digits$}{}", &name[end..]))
}

fn range(text: &str) -> Result<Range<u32>, String> {
    let parts = text.split_once("..").and_then(|(first, end)| Some((first.parse().ok()?, end.parse().ok()?)));
    match parts {
        Some((first, end)) if first < end => Ok(first..end),
        _ => Err("two numbers as 0..240 are needed, the first one smaller".to_owned()),
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(|| "a number is needed".to_owned())
}

const EXAMPLES: &str = "\
Examples:
  hybrid_oit                                        the picture of the README
  hybrid_oit --rt query --validate                  shadows by ray queries, under validation
  hybrid_oit --frames 0..480 --out film_####.png    one round of the animation
  hybrid_oit --frames 240..480 --out film_####.png  its second half, on another machine
  hybrid_oit --nodes 100000                         too few nodes: see what is lost
  hybrid_oit --profile mali-g715                    as on a phone

Exit status: 0 when the pictures were written, 1 for trouble with the device, 2 for wrong arguments or input.";

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    fn parsed(line: &str) -> Result<HybridOitArgs, clap::Error> {
        HybridOitArgs::try_parse_from(std::iter::once("hybrid_oit").chain(line.split_whitespace()))
    }

    #[test]
    fn the_definition_is_sound() {
        HybridOitArgs::command().debug_assert();
    }

    #[test]
    fn a_range_gives_a_picture_a_frame() {
        let shots = parsed("--frames 9..11 --out a/b_###.png").unwrap().shots().unwrap();
        let paths: Vec<_> = shots.iter().map(|shot| shot.path.to_str().unwrap()).collect();
        assert_eq!(paths, ["a/b_009.png", "a/b_010.png"]);
        assert_eq!(shots[1].seconds, 10.0 / 60.0);
        assert_eq!(parsed("--frame 10").unwrap().shots().unwrap()[0].seconds, shots[1].seconds);
        assert_eq!(parsed("--time 2.5").unwrap().shots().unwrap()[0].seconds, 2.5);
        assert!(parsed("--frames 0..2 --out same.png").unwrap().shots().is_err());
    }

    #[test]
    fn wrong_values_are_refused_with_exit_status_2() {
        for line in [
            "--frames 3",
            "--frames 5..5",
            "--frames 0..2 --time 1",
            "--frame 1 --time 1",
            "--time nan",
            "--supersampling 5",
            "--shadow-rays 0",
            "--nodes -1",
            "--width 0",
        ] {
            assert_eq!(parsed(line).unwrap_err().exit_code(), 2, "{line}");
        }
    }
}
