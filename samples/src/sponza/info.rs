//! The description of the sample's program.

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser as _};

use super::{DrawPath, Sponza, SponzaConfig, pipelines};
use crate::app::sample_info::prelude::*;
use crate::app::scene_args::SceneArgs;
use crate::app::value_parsers::whole;
use crate::scene::Scene;

/// Arguments of the sample.
#[derive(Debug, Clone, PartialEq, Args)]
#[command(next_help_heading = "Rendering")]
pub struct SponzaArgs {
    /// Samples per pixel, 1 or 4
    #[arg(
        long,
        value_name = "N",
        default_value_t = 4,
        value_parser = PossibleValuesParser::new(["1", "4"]).map(|samples| if samples == "1" { 1_u32 } else { 4 })
    )]
    pub msaa: u32,

    /// Draw everything, visible or not; the picture is the same
    #[arg(long)]
    pub no_culling: bool,

    /// Method of drawing the objects left after culling [default: counted, if the device supports it]
    #[arg(long, value_enum)]
    pub draws: Option<DrawPath>,

    /// Maximum triangles of a draw, 1 to 1000000
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = whole(1..=1_000_000))]
    pub draw_triangles: u32,

    /// Texels on an edge of the shadow map, 16 to 8192
    #[arg(long, value_name = "N", default_value_t = 2048)]
    #[arg(value_parser = whole(16..=SponzaConfig::MAX_SHADOW_SIZE))]
    pub shadow_size: u32,

    /// Radius of the shadow filter in texels, 0 to 4
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = whole(0..=SponzaConfig::MAX_FILTER))]
    pub filter: u32,

    /// Ignore normal maps (`norm`, `map_bump`)
    #[arg(long)]
    pub no_normal_maps: bool,

    /// The scene and its camera
    #[command(flatten)]
    pub scene: SceneArgs,
}

impl SponzaArgs {
    /// The configuration for images of `extent` pixels.
    fn config(&self, extent: [u32; 2]) -> SponzaConfig {
        SponzaConfig {
            samples: self.msaa,
            culls: !self.no_culling,
            draws: self.draws,
            shadow_size: self.shadow_size,
            filter: self.filter,
            triangles_per_draw: self.draw_triangles,
            normal_maps: !self.no_normal_maps,
            ..SponzaConfig::new(extent)
        }
    }

    fn load(&self, setup: &mut SampleSetup<'_>) -> Result<Scene, RunError> {
        if self.scene.scene.is_some() {
            return Ok(match self.no_normal_maps {
                true => self.scene.load(&mut setup.progress)?,
                false => self.scene.load_with_normal_maps(&mut setup.progress)?,
            });
        }
        setup.progress.stage("making the atrium", 0);
        Ok(Scene::atrium())
    }
}

impl SampleInfo for Sponza {
    const NAME: &'static str = "sponza";
    const ABOUT: &'static str =
        "Rasterises a large textured scene with shadows, culled on the GPU, and writes pictures as PNG";
    const DETAILS: &'static str = "Without --scene the sample renders a generated atrium with columns.";
    const EXAMPLES: &'static str = "
        | the atrium, on the most capable device
        --scene crytek_sponza.obj --camera 2 | an OBJ through its second camera
        --msaa 1 --filter 0 --no-culling | one sample, hard shadows, everything drawn
        --window --hot-reload | in a window, with hot reload of shaders
    ";
    const ROUND: &'static str = "one round through all cameras";
    type Args = SponzaArgs;
    type Sample = Self;

    fn pipelines() -> Vec<SamplePipeline> {
        pipelines::pipelines()
    }

    fn listing(args: &SponzaArgs) -> Option<String> {
        args.scene.list.listing_after("atrium  built in: a columned atrium made by code")
    }

    fn open(args: &SponzaArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Self>, RunError> {
        args.scene.check_out(&setup.args.out_or(Self::NAME))?;
        let scene = args.load(setup)?;
        let (context, scene) = setup.device_for_scene(scene, &DeviceNeeds::default())?;
        setup.progress.stage("uploading the scene", 0);
        let (triangles, textures, maps) =
            (scene.triangles.len(), scene.textures.len(), scene.normal_maps.len());
        let text = format!("{}: {triangles} triangles, {textures} textures, {maps} normal maps", scene.name);
        let cameras = Scene { cameras: scene.cameras, ..Scene::empty() };
        let sample = Self::new(&context, scene, &args.config(setup.extent()))?;
        let sample = sample.from_camera(&cameras, args.scene.camera.index());
        let path = match sample.draw_path() {
            DrawPath::Counted => "as many as the GPU has counted",
            DrawPath::Padded => "those that are culled without vertices",
        };
        let draws = format!(
            "draws     {}, {path}; {} samples a pixel",
            sample.draws().len(),
            sample.config().samples
        );
        Ok(ReadySample::raster(sample, &format!("{text}\n{draws}")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::cli::{assert_refuses, parse_line};

    #[test]
    fn values_out_of_range_are_refused() {
        assert_refuses::<Sponza>(&[
            "--msaa 2",
            "--draws some",
            "--shadow-size 15",
            "--filter 5",
            "--draw-triangles 0",
            "--camera 6",
            "x",
        ]);
        let args = parse_line::<Sponza>("--msaa 1 --no-culling --draws padded").unwrap().sample;
        let config = args.config([8, 8]);
        assert_eq!((config.samples, config.culls, config.draws), (1, false, Some(DrawPath::Padded)));
    }
}
