//! The sample's own arguments.

use std::path::{Path, PathBuf};

use clap::Args;
use lvk_samples::app::ray_args::RayArgs;
use lvk_samples::app::value_parsers::{positive, whole};

use crate::config::{
    Content, CullingMode, IndirectLight, LightRate, Method, PrimaryVisibility, ToneMapping, ViewerConfig,
};

/// Arguments of the sample.
#[derive(Debug, Clone, PartialEq, Args)]
#[command(next_help_heading = "Rendering")]
pub struct ViewerArgs {
    /// Model to show: glTF (.gltf, .glb) or Wavefront OBJ [default: the built-in showcase]
    #[arg(value_name = "FILE", help_heading = "Model")]
    pub file: Option<PathBuf>,

    /// Camera of the model, by its number in --list-cameras or its name [default: the first]
    #[arg(long, value_name = "NUMBER|NAME", help_heading = "Model")]
    pub camera: Option<String>,

    /// Print the cameras and animations of the model, and exit
    #[arg(long, help_heading = "Model")]
    pub list_cameras: bool,

    /// Animation to play, by its number in --list-cameras or its name [default: none, nodes stand as the file says]
    #[arg(long, value_name = "NUMBER|NAME", help_heading = "Model")]
    pub animation: Option<String>,

    /// Time of the animation in the first frame in seconds, 0 or more; after its end it begins anew
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, value_parser = seconds, requires = "animation")]
    #[arg(help_heading = "Model")]
    pub time: f32,

    /// Method that renders
    #[arg(long, value_enum, default_value_t = Method::Hybrid)]
    pub method: Method,

    /// Contents of the picture; all but light needs --method hybrid
    #[arg(long, value_enum, default_value_t = Content::Light)]
    pub view: Content,

    /// Samples of each pixel, 1 to 65536; of the hybrid method, frames that a still takes the mean of. Noise falls with their square
    /// root
    #[arg(long, value_name = "N", default_value_t = ViewerConfig::DEFAULT_SAMPLES)]
    #[arg(value_parser = whole(1..=ViewerConfig::MAX_SAMPLES))]
    pub samples: u32,

    /// Frames go on from those before, a sample each, as a window shows them: with a range of --frames, pictures of a camera or an animation in
    /// motion. --samples does not count
    #[arg(long, conflicts_with = "resume")]
    pub real_time: bool,

    /// Surfaces that a path meets at most, 1 to 256
    #[arg(long, value_name = "N", default_value_t = ViewerConfig::DEFAULT_BOUNCES, value_parser = whole(1..=256))]
    pub bounces: u32,

    /// Exposure in stops: each doubles the brightness
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, value_parser = stops, allow_negative_numbers = true)]
    pub exposure: f32,

    /// Mapping of radiance to what a display shows
    #[arg(long, value_enum, default_value_t = ToneMapping::Neutral)]
    pub tone: ToneMapping,

    /// Most memory of textures in MiB, 1 to 65536: mip levels come and go by what the picture needs [default: all levels stay]
    #[arg(long, value_name = "MIB", value_parser = whole(1..=65536))]
    pub texture_budget: Option<u32>,

    /// How the hybrid method finds the surfaces that pixels show
    #[arg(long, value_enum, default_value_t = PrimaryVisibility::Rays)]
    pub primary: PrimaryVisibility,

    /// Where the hybrid method takes the light from that surfaces beyond the visible ones scatter
    #[arg(long, value_enum, default_value_t = IndirectLight::default())]
    pub indirect: IndirectLight,

    /// Pixels that find light in each frame of the hybrid method: all, or one of each 2 x 2 by turns and those that the frame before did not
    /// see. Each then has about a quarter of the samples
    #[arg(long, value_enum, default_value_t = LightRate::default())]
    pub light_rate: LightRate,

    /// Entries of the radiance cache of --indirect cache, 1 to 16777216, of 40 bytes each; where they do not suffice, more paths go on
    #[arg(long, value_name = "N", default_value_t = ViewerConfig::DEFAULT_CACHE_ENTRIES)]
    #[arg(value_parser = whole(1..=ViewerConfig::MAX_CACHE_ENTRIES))]
    pub cache_entries: u32,

    /// Instances that --primary raster leaves out; the picture is the same
    #[arg(long, value_enum, default_value_t = CullingMode::Auto)]
    pub culling: CullingMode,

    /// Light from outside of the model
    #[command(flatten)]
    pub light: LightArgs,

    /// The ray tracing path
    #[command(flatten)]
    pub tracing: RayArgs,
}

/// Arguments that set the light from outside of the model.
#[derive(Debug, Clone, PartialEq, Args)]
#[command(next_help_heading = "Light")]
pub struct LightArgs {
    /// The sky: day, white, black, or a Radiance HDR file of all directions (.hdr), whose middle lies in +x and whose rows go from the
    /// zenith down. A file has its sun in it
    #[arg(long, value_name = "SKY", default_value = "day", value_parser = sky)]
    pub sky: SkyArg,

    /// Angle in degrees by which a file's sky is turned around the vertical, counter-clockwise from above
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, value_parser = degrees, allow_negative_numbers = true)]
    pub sky_rotation: f32,

    /// Angle of the sun above the horizon in degrees, 1 to 90
    #[arg(long, value_name = "DEGREES", default_value_t = 42.0, value_parser = elevation)]
    pub sun_elevation: f32,

    /// Angle of the sun around the vertical in degrees, from +z towards +x
    #[arg(long, value_name = "DEGREES", default_value_t = -58.0, value_parser = degrees, allow_negative_numbers = true)]
    pub sun_azimuth: f32,

    /// Radius of the discs of the sun and of directional lights in degrees; that of the real sun is 0.27
    #[arg(long, value_name = "DEGREES", default_value_t = 0.5, value_parser = radius)]
    pub sun_radius: f32,
}

/// The sky.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SkyArg {
    /// A clear day with its sun.
    Day,
    /// The same white from everywhere.
    White,
    /// No light but that of the model.
    Black,
    /// The picture of a Radiance HDR file.
    File(PathBuf),
}

fn sky(text: &str) -> Result<SkyArg, String> {
    let is_hdr = Path::new(text).extension().is_some_and(|extension| extension.eq_ignore_ascii_case("hdr"));
    match text {
        "day" => Ok(SkyArg::Day),
        "white" => Ok(SkyArg::White),
        "black" => Ok(SkyArg::Black),
        _ if is_hdr => Ok(SkyArg::File(PathBuf::from(text))),
        _ => Err("day, white, black or a file that ends with .hdr is needed".to_owned()),
    }
}

fn seconds(text: &str) -> Result<f32, String> {
    number_within(text, 0.0, 1e6)
}

fn stops(text: &str) -> Result<f32, String> {
    number_within(text, -20.0, 20.0)
}

fn elevation(text: &str) -> Result<f32, String> {
    number_within(text, 1.0, 90.0)
}

fn degrees(text: &str) -> Result<f32, String> {
    number_within(text, -360.0, 360.0)
}

fn radius(text: &str) -> Result<f32, String> {
    positive(text)?;
    number_within(text, 0.01, 45.0)
}

fn number_within(text: &str, min: f32, max: f32) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if (min..=max).contains(&value) => Ok(value),
        _ => Err(format!("a number from {min} to {max} is needed")),
    }
}
