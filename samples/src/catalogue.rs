//! Every sample of this crate, for programs and tests that go through all of them.

use std::ffi::OsString;
use std::process::ExitCode;

use clap::Command;

use crate::app::cli::{self, EventLoopBuilder};
use crate::app::sample_info::SampleInfo;
use crate::pipelines::SamplePipeline;
use crate::{
    deferred, hello_triangle, hybrid, hybrid_oit, large_scene, mesh_shaders, omni_shadows, reflections,
    render_to_cube_map, rtx_ao, rtx_hello, rtx_pipeline, rtx_textures, sponza, triplanar, yuv,
};

/// A [`SampleInfo`] without its types.
#[derive(Debug, Clone, Copy)]
pub struct CatalogueEntry {
    /// [`SampleInfo::NAME`].
    pub name: &'static str,
    /// Returns the command line.
    pub command: fn() -> Command,
    /// [`SampleInfo::pipelines`].
    pub pipelines: fn() -> Vec<SamplePipeline>,
    /// Runs the program: [`cli::main_with`].
    pub main: fn(Vec<OsString>, &mut EventLoopBuilder) -> ExitCode,
}

impl CatalogueEntry {
    const fn new<S: SampleInfo>() -> Self {
        Self { name: S::NAME, command: cli::command::<S>, pipelines: S::pipelines, main: cli::main_with::<S> }
    }
}

/// Every sample, by name.
pub const SAMPLES: [CatalogueEntry; 16] = [
    CatalogueEntry::new::<deferred::Deferred>(),
    CatalogueEntry::new::<hello_triangle::HelloTriangle>(),
    CatalogueEntry::new::<hybrid::HybridSequence>(),
    CatalogueEntry::new::<hybrid_oit::HybridOit>(),
    CatalogueEntry::new::<large_scene::LargeScene>(),
    CatalogueEntry::new::<mesh_shaders::MeshShaders>(),
    CatalogueEntry::new::<omni_shadows::OmniShadows>(),
    CatalogueEntry::new::<reflections::Reflections>(),
    CatalogueEntry::new::<render_to_cube_map::RenderToCubeMap>(),
    CatalogueEntry::new::<rtx_ao::RtxAo>(),
    CatalogueEntry::new::<rtx_hello::RtxHello>(),
    CatalogueEntry::new::<rtx_pipeline::RtxPipeline>(),
    CatalogueEntry::new::<rtx_textures::RtxTextures>(),
    CatalogueEntry::new::<sponza::Sponza>(),
    CatalogueEntry::new::<triplanar::Triplanar>(),
    CatalogueEntry::new::<yuv::Yuv>(),
];

/// Runs the sample that a line of text names, such as `rtx_ao --rt query`, with the arguments of the line and `more`: for
/// systems that start a program without arguments. Words end at white space.
#[must_use]
pub fn run_line(line: &str, more: Vec<OsString>, event_loop: &mut EventLoopBuilder) -> ExitCode {
    let words: Vec<OsString> = line.split_whitespace().map(OsString::from).collect();
    match words.first().and_then(|name| SAMPLES.iter().find(|sample| name == sample.name)) {
        Some(sample) => (sample.main)([words, more].concat(), event_loop),
        None => {
            let names = SAMPLES.map(|sample| sample.name).join(", ");
            let name = lvk::readable_name(line.trim());
            crate::app::print_message("error", format_args!("'{name}' names no sample; there are {names}"));
            ExitCode::from(2)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_line_is_valid_and_refuses_unknown_arguments() {
        for sample in SAMPLES {
            (sample.command)().debug_assert();
            let refused = (sample.command)().try_get_matches_from([sample.name, "x"]);
            assert_eq!(refused.map_err(|error| error.exit_code()), Err(2), "{}", sample.name);
        }
    }

    #[test]
    fn names_are_sorted_and_examples_fit() {
        assert!(SAMPLES.is_sorted_by_key(|sample| sample.name));
        for sample in SAMPLES {
            let help = (sample.command)().render_long_help().to_string();
            assert!(help.contains(&format!("\n  {} ", sample.name)), "{help}");
        }
    }
}
