//! The command line of the `yuv` sample.

use clap::Parser;

use super::config::{YuvConfig, YuvFormat, YuvModel, YuvRange};
use crate::app::run_args::RunArgs;

/// Shows a moving picture in Y'CbCr, and writes pictures as PNG.
#[derive(Debug, Clone, PartialEq, Parser)]
#[command(name = "yuv", version, after_help = EXAMPLES)]
pub struct YuvArgs {
    /// How the planes of the moving picture lie [default: the first that the device has]
    #[arg(long, value_enum, help_heading = "Rendering")]
    pub format: Option<YuvFormat>,

    /// The matrix between Y'CbCr and colours
    #[arg(long, value_enum, default_value_t = YuvModel::Bt709, help_heading = "Rendering")]
    pub model: YuvModel,

    /// Which numbers are black and white
    #[arg(long, value_enum, default_value_t = YuvRange::Narrow, help_heading = "Rendering")]
    pub range: YuvRange,

    /// Show Y, Cb and Cr at the left
    #[arg(long, help_heading = "Rendering")]
    pub show_planes: bool,

    /// Frames, pictures and device
    #[command(flatten)]
    pub run: RunArgs,
}

impl YuvArgs {
    /// What they ask for.
    pub(super) fn config(&self) -> YuvConfig {
        YuvConfig {
            format: self.format,
            model: self.model,
            range: self.range,
            shows_planes: self.show_planes,
            ..YuvConfig::new(self.run.extent())
        }
    }
}

const EXAMPLES: &str = "\
Examples:
  yuv                                                     a picture, in the first format that the device has
  yuv --window                                            in a window, where N goes on to the next format
  yuv --format p010 --model bt2020 --show-planes          ten bits, as of ultra high definition, and the planes beside it
  yuv --frames 0..240 --out dir/frame_####.png            one round of the animation; ranges can be shared among machines

Exit status: 0 when the pictures were written, 1 for trouble with the device, 2 for wrong arguments, 130 after Ctrl-C.";

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    fn parsed(line: &str) -> Result<YuvArgs, clap::Error> {
        YuvArgs::try_parse_from(std::iter::once("yuv").chain(line.split_whitespace()))
    }

    #[test]
    fn the_definition_is_sound_and_its_defaults_are_the_usual() {
        YuvArgs::command().debug_assert();
        assert_eq!(parsed("--width 64 --height 36").unwrap().config(), YuvConfig::new([64, 36]));
        let all = parsed("--format i010 --model bt2020 --range full --show-planes").unwrap().config();
        assert_eq!((all.format, all.model), (Some(YuvFormat::I010), YuvModel::Bt2020));
        assert_eq!((all.range, all.shows_planes), (YuvRange::Full, true));
    }

    #[test]
    fn unknown_values_are_refused() {
        for line in ["--format yuyv", "--model bt470", "--range wide", "--rt query"] {
            assert_eq!(parsed(line).unwrap_err().exit_code(), 2, "{line}");
        }
    }
}
