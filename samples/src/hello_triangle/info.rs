//! The description of the sample's program.

use super::HelloTriangle;
use super::renderer::TRIANGLE;
use crate::app::sample_info::prelude::*;

impl SampleInfo for HelloTriangle {
    const NAME: &'static str = "hello_triangle";
    const ABOUT: &'static str =
        "Rasterises a turning triangle, the first thing to draw, and writes pictures as PNG";
    type Args = NoArgs;
    type Sample = Self;

    fn pipelines() -> Vec<SamplePipeline> {
        vec![TRIANGLE.data()]
    }

    fn open(_: &NoArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Self>, RunError> {
        let sample = Self::new(&setup.device(&DeviceNeeds::default())?, setup.extent())?;
        Ok(ReadySample::raster(sample, "a turning triangle"))
    }
}
