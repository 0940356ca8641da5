//! The command line of the `deferred` sample.

use clap::Parser;

use super::{DeferredConfig, Passes, View};
use crate::app::run_args::RunArgs;

/// Lights a hall by hundreds of small lights, deferred and in one pass where the device can, and writes pictures as PNG.
#[derive(Debug, Clone, PartialEq, Parser)]
#[command(name = "deferred", version, after_help = EXAMPLES)]
pub struct DeferredArgs {
    /// How surfaces come to those who light them [default: one, where the device can]
    #[arg(long, value_enum, value_name = "PASSES", help_heading = "Picture")]
    pub passes: Option<Passes>,

    /// Number of lights, 1 to 4096
    #[arg(
        long,
        value_name = "N",
        default_value_t = DeferredConfig::LIGHTS,
        value_parser = clap::value_parser!(u32).range(1..=i64::from(DeferredConfig::MAX_LIGHTS)),
        help_heading = "Picture"
    )]
    pub lights: u32,

    /// What the picture shows
    #[arg(long, value_enum, value_name = "VIEW", default_value_t = View::Picture, help_heading = "Picture")]
    pub view: View,

    /// Frames, pictures and device
    #[command(flatten)]
    pub run: RunArgs,
}

impl DeferredArgs {
    /// What to render.
    #[must_use]
    pub fn config(&self) -> DeferredConfig {
        let Self { passes, lights, view, .. } = *self;
        DeferredConfig { extent: self.run.extent(), passes, lights, view }
    }
}

const EXAMPLES: &str = "\
Examples:
  deferred                                                a picture, in one pass where the best device can
  deferred --passes several --validate                    the same picture by textures, with validation
  deferred --lights 4096 --view normals                   what the lights look at
  deferred --window --hot-reload                          in a window, with switches for all of it
  deferred --frames 0..240 --out dir/frame_####.png       one round of the animation; ranges can be shared among machines

Exit status: 0 when the pictures were written, 1 for trouble with the device, 2 for wrong arguments, 130 after Ctrl-C.";

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_definition_is_sound_and_values_out_of_range_are_refused() {
        DeferredArgs::command().debug_assert();
        for line in ["--lights 0", "--lights 4097", "--passes two", "--view light", "x"] {
            let words = std::iter::once("deferred").chain(line.split_whitespace());
            let parsed = DeferredArgs::try_parse_from(words);
            assert_eq!(parsed.map_err(|error| error.exit_code()), Err(2), "{line}");
        }
    }
}
