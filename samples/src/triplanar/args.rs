//! The command line of the `triplanar` sample.

use clap::Parser;
use clap::builder::PossibleValuesParser;

use crate::app::run_args::RunArgs;
use crate::scene::PAINTED;

/// Draws bodies without texture coordinates, by textures along three axes, and writes pictures as PNG.
#[derive(Debug, Clone, PartialEq, Parser)]
#[command(name = "triplanar", version, after_help = EXAMPLES)]
pub struct TriplanarArgs {
    /// Textures to unload, with commas between them: a placeholder is shown in their place
    #[arg(
        long,
        value_name = "NAMES",
        value_delimiter = ',',
        value_parser = PossibleValuesParser::new(PAINTED.map(|painted| painted.name)),
        help_heading = "Rendering"
    )]
    pub unload: Vec<String>,

    /// Frames, pictures and device
    #[command(flatten)]
    pub run: RunArgs,
}

const EXAMPLES: &str = "\
Examples:
  triplanar                                               a picture, by the best device
  triplanar --window                                      in a window, where textures come and go
  triplanar --unload brick,leaves --validate              what a placeholder looks like, with validation
  triplanar --frames 0..240 --out dir/frame_####.png      one round of the animation; ranges can be shared among machines

Exit status: 0 when the pictures were written, 1 for trouble with the device, 2 for wrong arguments, 130 after Ctrl-C.";

impl TriplanarArgs {
    /// Numbers of the textures to unload.
    pub(super) fn unloaded(&self) -> impl Iterator<Item = usize> {
        self.unload.iter().filter_map(|name| PAINTED.iter().position(|painted| painted.name == name))
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn textures_are_named_and_others_refused() {
        TriplanarArgs::command().debug_assert();
        let parsed =
            |line: &str| TriplanarArgs::try_parse_from(std::iter::once("triplanar").chain(line.split(' ')));
        let numbers: Vec<_> = parsed("--unload leaves,paving").unwrap().unloaded().collect();
        assert_eq!(numbers.len(), 2);
        assert!(numbers.iter().zip(["leaves", "paving"]).all(|(number, name)| PAINTED[*number].name == name));
        assert_eq!(parsed("--unload gold").unwrap_err().exit_code(), 2);
    }
}
