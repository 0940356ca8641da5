//! The description of the sample's program.

use clap::Args;
use clap::builder::PossibleValuesParser;

use super::Triplanar;
use super::pipelines::MODELS;
use crate::app::sample_info::prelude::*;
use crate::scene::PAINTED;

/// Arguments of the sample.
#[derive(Debug, Clone, PartialEq, Args)]
pub struct TriplanarArgs {
    /// Textures to unload, separated by commas; frames show a placeholder instead
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    #[arg(value_parser = PossibleValuesParser::new(PAINTED.map(|painted| painted.name)))]
    #[arg(help_heading = "Rendering")]
    pub unload: Vec<String>,
}

impl TriplanarArgs {
    /// Numbers of the textures to unload.
    fn unloaded(&self) -> impl Iterator<Item = usize> {
        self.unload.iter().filter_map(|name| PAINTED.iter().position(|painted| painted.name == name))
    }
}

impl SampleInfo for Triplanar {
    const NAME: &'static str = "triplanar";
    const ABOUT: &'static str =
        "Draws bodies without texture coordinates, by textures along three axes, and writes pictures as PNG";
    const EXAMPLES: &'static str = "
        | a picture, on the most capable device
        --window | in a window, where textures load and unload
        --unload brick,leaves --validate | two placeholders, with validation
    ";
    type Args = TriplanarArgs;
    type Sample = Self;

    fn pipelines() -> Vec<SamplePipeline> {
        vec![MODELS.data()]
    }

    fn open(args: &TriplanarArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Self>, RunError> {
        let context = setup.device(&DeviceNeeds::default())?;
        setup.progress.stage("painting textures", 0);
        let mut sample = Self::new(&context, setup.extent())?;
        args.unloaded().for_each(|number| sample.unload(number));
        let (count, unloaded) = (Self::texture_names().len(), args.unload.len());
        let scene =
            format!("bodies without texture coordinates; {count} textures, {unloaded} of them unloaded");
        Ok(ReadySample::raster(sample, &scene))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::cli::{assert_refuses, parse_line};

    #[test]
    fn textures_are_named_and_others_refused() {
        let args = parse_line::<Triplanar>("--unload leaves,paving").unwrap().sample;
        let numbers: Vec<_> = args.unloaded().collect();
        assert_eq!(numbers.len(), 2);
        assert!(numbers.iter().zip(["leaves", "paving"]).all(|(number, name)| PAINTED[*number].name == name));
        assert_refuses::<Triplanar>(&["--unload gold"]);
    }
}
