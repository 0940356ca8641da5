//! The configuration of the sample.

use clap::ValueEnum;
use lvk::{Capabilities, RayQueryPath};
use lvk_samples::app::sample_error::SampleError;
use lvk_samples::hybrid::RayPath;

/// The mapping of radiance to what a display shows, by its number in `shaders/viewer/tone.glsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
#[repr(u32)]
pub enum ToneMapping {
    /// Khronos PBR Neutral: colours of materials stay, highlights are compressed.
    #[default]
    Neutral,
    /// No mapping; what is too bright is clipped.
    Linear,
}

/// The method that renders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Method {
    /// Trace a path from the surface of each pixel, and filter over time and space.
    #[default]
    Hybrid,
    /// Trace paths from the camera, without a bias: the reference.
    #[value(name = "pathtrace")]
    PathTrace,
}

/// Contents of the picture, by their numbers in `shaders/viewer/plane.glsl`. All but light is known to the hybrid method alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
#[repr(u32)]
pub enum Content {
    /// Light.
    #[default]
    Light = 0,
    /// Normals: red to the right, green up, blue towards +z.
    Normals,
    /// Roughness.
    Roughness,
    /// Motion since the frame before: red to the right, green down; without motion grey.
    Motion,
    /// Albedo of matte layers.
    Albedo,
    /// Light that matte layers receive, filtered.
    Matte,
    /// Light that all other layers receive, filtered.
    Mirrored,
    /// Steps of the ray of each pixel through the acceleration structures, from black over blue, green and red to white at 512 and
    /// more. Software ray queries count them; where a device traverses, all is black.
    Steps,
}

/// True if a device counts the steps of its rays, for [`Content::Steps`]: those of the library's own traversal.
pub(crate) fn counts_steps(capabilities: &Capabilities) -> bool {
    capabilities.ray_query_path == RayQueryPath::Software
}

/// Where the hybrid method takes the light from that surfaces beyond the visible ones scatter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum IndirectLight {
    /// A radiance cache, which a part of the paths updates. It remembers the light of small cells over some frames.
    Cache,
    /// Paths alone, each with all of its surfaces.
    #[default]
    Paths,
    /// A constant, less of it near other surfaces. Three rays for most pixels, and more in mirrors and glass.
    AmbientOcclusion,
}

/// Pixels that find light in a frame of the hybrid method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum LightRate {
    /// All.
    #[default]
    Full,
    /// One of each 2 x 2 by turns, those of which the frames before know nothing, and those whose paths update the radiance cache. All
    /// others have the mean of their samples in the frames before.
    Quarter,
}

/// How the hybrid method finds the surfaces that pixels show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum PrimaryVisibility {
    /// Trace a ray for each pixel. The time grows with the pixels, and little with the triangles.
    #[default]
    Rays,
    /// Rasterise a visibility buffer: instance, geometry and primitive of each pixel.
    Raster,
}

/// Culling of instances before the hybrid method rasterises them. The picture is the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum CullingMode {
    /// Occlusion for models with at least 64 instances, the frustum for others.
    #[default]
    Auto,
    /// All are rasterised.
    None,
    /// Those outside of the camera's frustum are left out.
    Frustum,
    /// Those that others hide are left out too.
    Occlusion,
}

/// Fewest instances for which looking for hidden ones is worth its passes.
const FEWEST_FOR_OCCLUSION: u32 = 64;

/// The configuration of the sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewerConfig {
    /// The method that renders.
    pub method: Method,
    /// The part of Vulkan that traces rays.
    pub path: RayPath,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Samples of each pixel, 1 to [`ViewerConfig::MAX_SAMPLES`]; of the hybrid method, frames of the still.
    pub samples: u32,
    /// Surfaces that a path meets at most, at least 1.
    pub bounces: u32,
    /// Exposure in stops.
    pub exposure_stops: f32,
    /// Mapping of radiance to what a display shows.
    pub tone_mapping: ToneMapping,
    /// Contents of the picture.
    pub content: Content,
    /// Most bytes of textures, whose mip levels then come and go by what shaders read; all levels stay if there is none. It is that of
    /// the model for as long as the model is shown.
    pub texture_budget: Option<u64>,
    /// How the hybrid method finds the surfaces that pixels show.
    pub primary: PrimaryVisibility,
    /// Where the hybrid method takes the light from that surfaces beyond the visible ones scatter.
    pub indirect: IndirectLight,
    /// Pixels that find light in a frame of the hybrid method.
    pub light_rate: LightRate,
    /// Entries of the radiance cache, 1 to [`ViewerConfig::MAX_CACHE_ENTRIES`]. Where they do not suffice, more paths go on.
    pub cache_entries: u32,
    /// Culling of instances that are rasterised.
    pub culling: CullingMode,
    /// True if each frame goes on from those before with one sample, as in a window; else each frame has all its samples.
    pub is_progressive: bool,
}

impl ViewerConfig {
    /// Largest number of samples.
    pub const MAX_SAMPLES: u32 = 65_536;
    /// Usual number of samples.
    pub const DEFAULT_SAMPLES: u32 = 64;
    /// Usual largest number of surfaces of a path.
    pub const DEFAULT_BOUNCES: u32 = 32;
    /// Most entries of the radiance cache.
    pub const MAX_CACHE_ENTRIES: u32 = 1 << 24;
    /// Usual number of entries of the radiance cache.
    pub const DEFAULT_CACHE_ENTRIES: u32 = 1 << 20;

    /// A picture of this size by `path`, everything else as usual.
    #[must_use]
    pub fn new(path: RayPath, width: u32, height: u32) -> Self {
        Self {
            method: Method::default(),
            path,
            width,
            height,
            samples: Self::DEFAULT_SAMPLES,
            bounces: Self::DEFAULT_BOUNCES,
            exposure_stops: 0.0,
            tone_mapping: ToneMapping::default(),
            content: Content::default(),
            texture_budget: None,
            primary: PrimaryVisibility::default(),
            indirect: IndirectLight::default(),
            light_rate: LightRate::default(),
            cache_entries: Self::DEFAULT_CACHE_ENTRIES,
            culling: CullingMode::default(),
            is_progressive: false,
        }
    }

    /// Width and height.
    pub(crate) fn extent(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// True if frames have a radiance cache.
    pub(crate) fn caches(&self) -> bool {
        self.method == Method::Hybrid && self.indirect == IndirectLight::Cache
    }

    /// True if frames have ambient occlusion.
    pub(crate) fn occludes_ambient(&self) -> bool {
        self.method == Method::Hybrid && self.indirect == IndirectLight::AmbientOcclusion
    }

    /// Frames from one turn of a pixel to find light to the next (`kTurns` in `shaders/viewer/light_turn.glsl`).
    pub(crate) fn light_turns(&self) -> u32 {
        match (self.method, self.light_rate) {
            (Method::Hybrid, LightRate::Quarter) => 4,
            (Method::PathTrace, _) | (_, LightRate::Full) => 1,
        }
    }

    /// True if frames are rasterised.
    pub(crate) fn rasterises(&self) -> bool {
        self.method == Method::Hybrid && self.primary == PrimaryVisibility::Raster
    }

    /// True if frames are rasterised and culled.
    pub(crate) fn culls(&self) -> bool {
        self.rasterises() && self.culling != CullingMode::None
    }

    /// True if frames of a model with this many instances leave out what others hide.
    pub(crate) fn occludes(&self, instance_count: u32) -> bool {
        let is_on = match self.culling {
            CullingMode::Auto => instance_count >= FEWEST_FOR_OCCLUSION,
            CullingMode::Occlusion => true,
            CullingMode::None | CullingMode::Frustum => false,
        };
        self.rasterises() && is_on
    }

    pub(crate) fn check(&self, capabilities: &Capabilities) -> Result<(), SampleError> {
        SampleError::check_size(self.extent(), capabilities)?;
        SampleError::check_range("--samples", self.samples, [1, Self::MAX_SAMPLES])?;
        SampleError::check_range("--bounces", self.bounces, [1, u32::MAX - 1])?;
        SampleError::check_range("--cache-entries", self.cache_entries, [1, Self::MAX_CACHE_ENTRIES])?;
        RayPath::choose(Some(self.path), capabilities)?;
        if self.content == Content::Steps && !capabilities.ray_query {
            let (device, lacks) =
                (capabilities.device_name.clone(), "ray queries here, whose steps the view counts");
            return Err(SampleError::PathMissing { device, lacks, instead: "software" });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config(method: Method, culling: CullingMode) -> ViewerConfig {
        let primary = PrimaryVisibility::Raster;
        ViewerConfig { method, primary, culling, ..ViewerConfig::new(RayPath::Query, 8, 8) }
    }

    #[test]
    fn few_instances_are_not_worth_the_passes_of_occlusion_unless_it_is_asked_for() {
        let occludes = |culling, count| config(Method::Hybrid, culling).occludes(count);
        assert_eq!([63, 64].map(|count| occludes(CullingMode::Auto, count)), [false, true]);
        assert_eq!([0, 1].map(|count| occludes(CullingMode::Occlusion, count)), [true; 2]);
        assert_eq!([64, 10_000].map(|count| occludes(CullingMode::Frustum, count)), [false; 2]);
        assert!(!config(Method::Hybrid, CullingMode::None).culls());
        let traced = config(Method::PathTrace, CullingMode::Occlusion);
        assert!(!traced.culls() && !traced.occludes(64), "paths rasterise nothing");
        let by_rays = ViewerConfig { method: Method::Hybrid, primary: PrimaryVisibility::Rays, ..traced };
        assert!(!by_rays.rasterises() && !by_rays.culls() && !by_rays.occludes(64));
    }
}
