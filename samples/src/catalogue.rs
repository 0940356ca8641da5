//! Every sample of this crate, for programs and tests that go through all of them.

use clap::Command;

use crate::app::cli;
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
}

impl CatalogueEntry {
    const fn new<S: SampleInfo>() -> Self {
        Self { name: S::NAME, command: cli::command::<S>, pipelines: S::pipelines }
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
