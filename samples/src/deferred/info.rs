//! The description of the sample's program.

use clap::Args;

use super::{Deferred, DeferredConfig, Passes, View, pipelines};
use crate::app::sample_info::prelude::*;
use crate::app::value_parsers::whole;

/// Arguments of the sample.
#[derive(Debug, Clone, PartialEq, Args)]
#[command(next_help_heading = "Picture")]
pub struct DeferredArgs {
    /// Transfer of surfaces to the lighting [default: one, if the device supports it]
    #[arg(long, value_enum, value_name = "PASSES")]
    pub passes: Option<Passes>,

    /// Number of lights, 1 to 4096
    #[arg(long, value_name = "N", default_value_t = DeferredConfig::LIGHTS)]
    #[arg(value_parser = whole(1..=DeferredConfig::MAX_LIGHTS))]
    pub lights: u32,

    /// Quantity that the image shows
    #[arg(long, value_enum, value_name = "VIEW", default_value_t = View::Picture)]
    pub view: View,
}

impl SampleInfo for Deferred {
    const NAME: &'static str = "deferred";
    const ABOUT: &'static str = "Lights a hall by hundreds of small lights, deferred and in one pass if the device supports it, and writes pictures as PNG";
    const EXAMPLES: &'static str = "
        | a picture, in one pass if the device supports it
        --passes several --validate | the same picture by textures, with validation
        --lights 4096 --view normals | the normals that the lighting reads
        --window --hot-reload | in a window, with a panel for all options
    ";
    type Args = DeferredArgs;
    type Sample = Self;

    fn pipelines() -> Vec<SamplePipeline> {
        pipelines::pipelines()
    }

    fn open(args: &DeferredArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Self>, RunError> {
        let context = setup.device(&DeviceNeeds::default())?;
        let DeferredArgs { passes, lights, view } = *args;
        let sample = Self::new(&context, &DeferredConfig { extent: setup.extent(), passes, lights, view })?;
        let passes = match sample.passes() {
            Passes::One => "one pass reads its own targets",
            Passes::Several => "passes read what those before have drawn",
        };
        let scene = format!("{lights} lights, {} triangles; {passes}", sample.triangle_count());
        Ok(ReadySample::raster(sample, &scene))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::cli::assert_refuses;

    #[test]
    fn values_out_of_range_are_refused() {
        assert_refuses::<Deferred>(&["--lights 0", "--lights 4097", "--passes two", "--view light", "x"]);
    }
}
