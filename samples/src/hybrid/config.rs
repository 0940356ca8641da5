//! The configuration of the sample.

use crate::app::sample_error::SampleError;
use lvk::{Capabilities, RayQueryPath};

use super::args;
use crate::app::ray_args::RayTracing;

/// The method that finds primary visibility.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Every pixel's ray is traced.
    Standalone,
    /// A geometry pass rasterises into a G-buffer; rays are traced from there.
    #[default]
    Hybrid,
}

/// The output of the hybrid method's geometry pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Geometry {
    /// Position, normals, albedo and triangle of each pixel, as in the paper.
    Paper,
    /// The triangle of each pixel, by some rasteriser; `None` takes compute where the device can.
    Visibility(Option<Raster>),
}

impl Default for Geometry {
    fn default() -> Self {
        Self::Visibility(None)
    }
}

/// The rasteriser that finds visible triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Raster {
    /// Compute shaders with 64-bit atomics (`shaderBufferInt64Atomics`).
    Compute,
    /// The device's own, after culling in compute shaders.
    Hardware,
}

/// Numbers that change how fast the compute rasteriser is, and nothing else.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RasterTuning {
    /// Most pixels of the rectangle around a triangle that one thread rasterises; `None` for what suits the device.
    pub small_pixels: Option<u32>,
    /// Most pixels of the rectangle around a triangle that some threads rasterise together; larger ones are cut into tiles;
    /// `None` for what suits the device.
    pub medium_pixels: Option<u32>,
    /// Medium and large triangles that there is room for, 104 bytes each, at most [`RasterTuning::MOST_SET_ASIDE`];
    /// further ones are rasterised by the thread that found them.
    pub set_aside: u32,
    /// Tiles of large triangles that there is room for, 8 bytes each; further ones are rasterised by the thread that found
    /// them.
    pub tiles: u32,
}

impl RasterTuning {
    /// As many triangles as the workgroups of one dispatch take on.
    pub const MOST_SET_ASIDE: u32 = 8 * 65_535;
}

impl Default for RasterTuning {
    fn default() -> Self {
        Self { small_pixels: None, medium_pixels: None, set_aside: 1 << 17, tiles: 1 << 18 }
    }
}

/// The time at which rays of mirrors and glass are traced.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bounces {
    /// The thread of the pixel traces them at once.
    Inline,
    /// A launch of their own, of only the pixels that have such rays: the same picture.
    Queued,
    /// The thread of the pixel, as for `Inline`, but pixels with such rays are launched first: the same picture. Only where
    /// visible triangles are known before any ray: by the hybrid method from [`Geometry::Visibility`].
    First,
}

/// The part of Vulkan that traces rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RayPath {
    /// A ray tracing pipeline.
    Pipeline,
    /// Ray queries in a compute shader.
    Query,
}

/// The configuration of the sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HybridConfig {
    /// The method that finds primary visibility.
    pub method: Method,
    /// The part of Vulkan that traces rays.
    pub path: RayPath,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Largest number of reflections and refractions of a ray, 0 to [`HybridConfig::MAX_DEPTH`].
    pub max_depth: u32,
    /// The time at which reflected and refracted rays are traced; `None` for the one that suits the device.
    pub bounces: Option<Bounces>,
    /// Views of each pixel, evenly spread over it, whose average it shows: 1 to [`HybridConfig::MAX_SAMPLES`].
    pub samples: u32,
    /// The output of the geometry pass; unused where the method has none.
    pub geometry: Geometry,
    /// Numbers of the compute rasteriser.
    pub tuning: RasterTuning,
}

impl Default for HybridConfig {
    /// The hybrid method by the ray tracing pipeline, 1280 x 720 pixels of one sample each, depth 4.
    fn default() -> Self {
        Self {
            method: Method::Hybrid,
            path: RayPath::Pipeline,
            width: 1280,
            height: 720,
            max_depth: 4,
            bounces: None,
            samples: 1,
            geometry: Geometry::default(),
            tuning: RasterTuning::default(),
        }
    }
}

impl HybridConfig {
    /// The largest depth; every level costs a place on each pixel's stack of waiting rays.
    pub const MAX_DEPTH: u32 = args::MAX_DEPTH;
    /// The largest number of samples.
    pub const MAX_SAMPLES: u32 = args::MAX_SAMPLES;

    /// True if the triangles that pixels show are known before any ray is traced.
    pub(super) fn knows_triangles(&self) -> bool {
        self.method == Method::Hybrid && matches!(self.geometry, Geometry::Visibility(_))
    }

    /// Checks sizes and depth against what the device with `capabilities` can do.
    pub(super) fn check(&self, capabilities: &Capabilities) -> Result<(), SampleError> {
        SampleError::check_size([self.width, self.height], capabilities)?;
        SampleError::check_range("--depth", self.max_depth, [0, Self::MAX_DEPTH])?;
        SampleError::check_range("--samples", self.samples, [1, Self::MAX_SAMPLES])?;
        if self.bounces == Some(Bounces::First) && !self.knows_triangles() {
            return Err(SampleError::NothingFirst);
        }
        let numbers_fragments =
            matches!(self.geometry, Geometry::Paper | Geometry::Visibility(Some(Raster::Hardware)));
        if self.method == Method::Hybrid && numbers_fragments && !capabilities.primitive_id {
            return Err(SampleError::NoPrimitiveId { device: capabilities.device_name.clone() });
        }
        if self.knows_triangles() && Method::choose(None, capabilities) == Method::Standalone {
            return Err(SampleError::NoRasteriser { device: capabilities.device_name.clone() });
        }
        self.path.check(capabilities)
    }
}

impl Method {
    /// The method to take: `wish`, or hybrid where the device can find visible triangles by one of the rasterisers, else
    /// stand-alone.
    #[must_use]
    pub fn choose(wish: Option<Self>, capabilities: &Capabilities) -> Self {
        let by_compute = capabilities.shader_int64 && capabilities.buffer_int64_atomics;
        match wish {
            Some(method) => method,
            None if by_compute || capabilities.primitive_id => Self::Hybrid,
            None => Self::Standalone,
        }
    }
}

impl RayPath {
    /// The path that the command line names, if it does.
    #[must_use]
    pub fn from_args(wish: RayTracing) -> Option<Self> {
        match wish {
            RayTracing::Auto => None,
            RayTracing::Pipeline | RayTracing::Hardware => Some(Self::Pipeline),
            RayTracing::Query | RayTracing::Software => Some(Self::Query),
        }
    }

    /// The path to take: `wish`; else the pipeline where the device has one, which scenes of all kinds do well by, else the query; on
    /// a CPU queries in software, if those are on, which are faster there for every scene.
    ///
    /// # Errors
    /// [`SampleError::NoRayTracing`] and [`SampleError::PathMissing`] say what the device lacks.
    pub fn choose(wish: Option<Self>, capabilities: &Capabilities) -> Result<Self, SampleError> {
        let path = match wish {
            Some(path) => path,
            None if capabilities.is_cpu && capabilities.ray_query_path == RayQueryPath::Software => {
                Self::Query
            }
            None if capabilities.ray_query && capabilities.ray_tracing_pipeline_path.is_lowered() => {
                Self::Query
            }
            None if capabilities.ray_tracing_pipeline => Self::Pipeline,
            None => Self::Query,
        };
        path.check(capabilities).map(|()| path)
    }

    fn check(self, capabilities: &Capabilities) -> Result<(), SampleError> {
        let Capabilities { ray_tracing_pipeline: pipeline, ray_query: query, .. } = *capabilities;
        let device = capabilities.device_name.clone();
        match self {
            Self::Pipeline if pipeline => Ok(()),
            Self::Query if query => Ok(()),
            _ if !pipeline && !query => {
                let hidden = || Some(format!("under the profile '{}'", capabilities.profile.as_ref()?));
                let reason = capabilities.ray_tracing_fallback.clone().or_else(hidden);
                let reason = reason.map_or_else(String::new, |reason| format!(" ({reason})"));
                Err(SampleError::NoRayTracing { device, reason })
            }
            Self::Pipeline => {
                Err(SampleError::PathMissing { device, lacks: "ray tracing pipelines", instead: "query" })
            }
            Self::Query => {
                Err(SampleError::PathMissing { device, lacks: "ray queries", instead: "pipeline" })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use lvk::{Limits, RayTracingPipelinePath};

    use super::*;

    fn device(pipeline: bool, query: bool) -> Capabilities {
        Capabilities {
            device_name: "Thing 3000".to_owned(),
            ray_tracing_pipeline: pipeline,
            ray_query: query,
            primitive_id: true,
            limits: Limits { max_texture_2d: 4096, ..Limits::default() },
            ..Capabilities::default()
        }
    }

    fn config() -> HybridConfig {
        HybridConfig { path: RayPath::Query, width: 64, height: 64, ..HybridConfig::default() }
    }

    #[test]
    fn auto_prefers_the_pipeline_and_falls_back() {
        assert_eq!(RayPath::choose(None, &device(true, true)).unwrap(), RayPath::Pipeline);
        assert_eq!(RayPath::choose(None, &device(false, true)).unwrap(), RayPath::Query);
        let walked = Capabilities { ray_query_path: RayQueryPath::Software, ..device(true, true) };
        assert_eq!(RayPath::choose(None, &walked).unwrap(), RayPath::Pipeline);
        let cpu = Capabilities { is_cpu: true, ..walked };
        assert_eq!(RayPath::choose(None, &cpu).unwrap(), RayPath::Query);
        let lowered = Capabilities {
            ray_tracing_pipeline_path: RayTracingPipelinePath::Software,
            ..device(true, true)
        };
        assert_eq!(RayPath::choose(None, &lowered).unwrap(), RayPath::Query);
        let alone = Capabilities { ray_query: false, ..lowered };
        assert_eq!(RayPath::choose(None, &alone).unwrap(), RayPath::Pipeline);
        assert!(matches!(
            RayPath::choose(None, &device(false, false)),
            Err(SampleError::NoRayTracing { .. })
        ));
    }

    #[test]
    fn a_profile_that_hides_all_ray_tracing_is_named() {
        let profile = Some("no-ray-tracing".to_owned());
        let capabilities = Capabilities { profile, ..device(false, false) };
        let message = RayPath::choose(None, &capabilities).unwrap_err().to_string();
        assert!(message.contains("(under the profile 'no-ray-tracing')"), "{message}");
    }

    #[test]
    fn a_forced_path_is_never_replaced() {
        assert_eq!(RayPath::choose(Some(RayPath::Query), &device(true, true)).unwrap(), RayPath::Query);
        let error = RayPath::choose(Some(RayPath::Query), &device(true, false)).unwrap_err();
        assert_eq!(error.to_string(), "Thing 3000 has no ray queries; use --rt pipeline");
        let error = RayPath::choose(Some(RayPath::Pipeline), &device(false, true)).unwrap_err();
        assert_eq!(error.to_string(), "Thing 3000 has no ray tracing pipelines; use --rt query");
    }

    #[test]
    fn impossible_pictures_are_refused() {
        let capabilities = device(true, true);
        assert!(config().check(&capabilities).is_ok());
        for (width, height) in [(0, 64), (64, 0), (5000, 64), (64, u32::MAX)] {
            let error = HybridConfig { width, height, ..config() }.check(&capabilities).unwrap_err();
            assert!(matches!(error, SampleError::BadSize { .. }), "{error}");
        }
        let deep = HybridConfig { max_depth: HybridConfig::MAX_DEPTH + 1, ..config() };
        assert!(matches!(deep.check(&capabilities), Err(SampleError::OutOfRange { .. })));
        for samples in [0, HybridConfig::MAX_SAMPLES + 1] {
            let error = HybridConfig { samples, ..config() }.check(&capabilities).unwrap_err();
            assert!(matches!(error, SampleError::OutOfRange { .. }), "{error}");
        }
    }

    #[test]
    fn only_the_hardware_rasteriser_needs_triangle_numbers() {
        let mut capabilities = device(true, true);
        capabilities.primitive_id = false;
        for geometry in [Geometry::Paper, Geometry::Visibility(Some(Raster::Hardware))] {
            let config = HybridConfig { geometry, ..config() };
            assert!(matches!(config.check(&capabilities), Err(SampleError::NoPrimitiveId { .. })));
            assert!(HybridConfig { method: Method::Standalone, ..config }.check(&capabilities).is_ok());
        }
        assert!(matches!(config().check(&capabilities), Err(SampleError::NoRasteriser { .. })));
        (capabilities.shader_int64, capabilities.buffer_int64_atomics) = (true, true);
        assert!(config().check(&capabilities).is_ok());
    }

    #[test]
    fn the_method_follows_the_device_unless_it_is_named() {
        let mut capabilities = device(false, true);
        assert_eq!(Method::choose(None, &capabilities), Method::Hybrid);
        (capabilities.primitive_id, capabilities.shader_int64) = (false, true);
        assert_eq!(Method::choose(None, &capabilities), Method::Standalone);
        assert_eq!(Method::choose(Some(Method::Hybrid), &capabilities), Method::Hybrid);
        capabilities.buffer_int64_atomics = true;
        assert_eq!(Method::choose(None, &capabilities), Method::Hybrid);
        assert_eq!(Method::choose(Some(Method::Standalone), &capabilities), Method::Standalone);
    }
}
