//! The description of the sample's program.

use clap::Args;

use super::Yuv;
use super::config::{CONVERSIONS, YuvConfig, YuvFormat, YuvModel, YuvRange};
use super::pipelines::{PICTURE, PLANES};
use crate::app::sample_info::prelude::*;

/// Arguments of the sample.
#[derive(Debug, Clone, PartialEq, Args)]
#[command(next_help_heading = "Rendering")]
pub struct YuvArgs {
    /// Plane layout of the moving image [default: the first that the device supports]
    #[arg(long, value_enum)]
    pub format: Option<YuvFormat>,

    /// The matrix between Y'CbCr and colours
    #[arg(long, value_enum, default_value_t = YuvModel::Bt709)]
    pub model: YuvModel,

    /// Values of black and white
    #[arg(long, value_enum, default_value_t = YuvRange::Narrow)]
    pub range: YuvRange,

    /// Show Y, Cb and Cr at the left
    #[arg(long)]
    pub show_planes: bool,
}

impl YuvArgs {
    /// The configuration for images of `extent` pixels.
    fn config(&self, extent: [u32; 2]) -> YuvConfig {
        let Self { format, model, range, show_planes: shows_planes } = *self;
        YuvConfig { format, model, range, shows_planes, ..YuvConfig::new(extent) }
    }
}

impl SampleInfo for Yuv {
    const NAME: &'static str = "yuv";
    const ABOUT: &'static str = "Shows a moving picture in Y'CbCr, and writes pictures as PNG";
    const EXAMPLES: &'static str = "
        | a picture, in the first format that the device supports
        --window | in a window, where N selects the next format
        --format p010 --model bt2020 --show-planes | ten bits, as in ultra high definition, with its planes
    ";
    type Args = YuvArgs;
    type Sample = Self;

    fn pipelines() -> Vec<SamplePipeline> {
        vec![PICTURE.data(), PLANES.data()]
    }

    fn open(args: &YuvArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Self>, RunError> {
        let context = setup.device(&DeviceNeeds { yuv: &CONVERSIONS, ..DeviceNeeds::default() })?;
        let config = args.config(setup.extent());
        let sample = Self::new(&context, &config)?;
        let (format, [width, height]) = (sample.format(), config.video_size);
        let (model, range, all) = (config.model, config.range, sample.formats());
        let scene = format!(
            "a moving picture of {width}x{height} as {format:?}, {model:?}, {range:?} range; the device has {all:?}"
        );
        Ok(ReadySample::raster(sample, &scene))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::cli::{assert_refuses, parse_line};

    #[test]
    fn defaults_are_the_usual() {
        let config = |line| parse_line::<Yuv>(line).unwrap().sample.config([64, 36]);
        assert_eq!(config(""), YuvConfig::new([64, 36]));
        let all = config("--format i010 --model bt2020 --range full --show-planes");
        assert_eq!((all.format, all.model), (Some(YuvFormat::I010), YuvModel::Bt2020));
        assert_eq!((all.range, all.shows_planes), (YuvRange::Full, true));
    }

    #[test]
    fn unknown_values_are_refused() {
        assert_refuses::<Yuv>(&["--format yuyv", "--model bt470", "--range wide", "--rt query"]);
    }
}
