//! The description of the sample's program.

use super::HelloTriangle;
use super::renderer::TRIANGLE;
use crate::app::cli::{ReadySample, SampleSetup};
use crate::app::device::DeviceNeeds;
use crate::app::run_error::RunError;
use crate::app::sample_info::{Example, NoArgs, SEQUENCE, SampleInfo};
use crate::pipelines::SamplePipeline;

impl SampleInfo for HelloTriangle {
    const NAME: &'static str = "hello_triangle";
    const ABOUT: &'static str =
        "Rasterises a turning triangle, the first thing to draw, and writes pictures as PNG";
    const EXAMPLES: &'static [Example] = &[
        ("", "a picture, by the best device"),
        ("--window --hot-reload", "in a window, whose shaders can be changed meanwhile"),
        SEQUENCE,
        ("--validate", "with validation"),
    ];
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
