//! The real-time method: visible surfaces, a path of light for each, and filters over time and space.

mod ambient_probe;
mod depth_pyramid;
mod passes;
mod radiance_cache;
mod visibility;

use lvk::{BufferHandle, Context, Holder};
use lvk_samples::app::array_buffer::buffer;
use lvk_samples::app::frame::Frame;

use crate::config::ViewerConfig;
use crate::gpu::layout::{Push, VisibilityConstants};
use crate::gpu::{FrameChange, FrameScene};
use crate::path_pass::{PathAddresses, PathWork};
use ambient_probe::AmbientProbe;
use passes::Passes;
use radiance_cache::RadianceCache;
pub(crate) use radiance_cache::{CacheConstants, cell_share};
use visibility::Visibility;
pub(crate) use visibility::{DEPTH_FORMAT, TRIANGLE_FORMAT};

/// Planes of `shaders/viewer/plane.glsl`.
const PLANES: u64 = 20;
/// The plane that the picture is made of (`kPlaneShown` there).
const SHOWN: u64 = 19;
/// Bytes of an element of a plane.
const ELEMENT: u64 = 16;

/// Passes and data of the real-time method, for pictures of one size.
pub(crate) struct Hybrid {
    /// The rasteriser; rays find the surfaces where there is none.
    visibility: Option<Visibility>,
    passes: Passes,
    /// The light where paths end; they go on to their own end where there is none.
    cache: Option<RadianceCache>,
    /// The probe for ambient light, where paths end with that.
    ambient: Option<AmbientProbe>,
    planes: Holder<BufferHandle>,
    extent: [u32; 2],
}

impl Hybrid {
    /// Passes for pictures of a configuration. `occludes`: culling leaves out what others hide.
    pub(crate) fn new(ctx: &Context, config: &ViewerConfig, occludes: bool) -> lvk::Result<Self> {
        let extent = config.extent();
        let size_bytes = PLANES * plane_bytes(extent);
        let mut visibility = config.rasterises().then(|| Visibility::new(ctx, extent)).transpose()?;
        if let Some(visibility) = &mut visibility {
            visibility.set_occlusion(ctx, occludes)?;
        }
        Ok(Self {
            visibility,
            passes: Passes::new(ctx, config)?,
            cache: config.caches().then(|| RadianceCache::new(ctx, config)).transpose()?,
            ambient: config.occludes_ambient().then(|| AmbientProbe::new(ctx, config.path)).transpose()?,
            planes: buffer(ctx, "planes", size_bytes)?,
            extent,
        })
    }

    /// Address of the planes.
    pub(crate) fn planes_address(&self) -> lvk::Result<u64> {
        self.planes.address()
    }

    /// Addresses of the paths of light.
    pub(crate) fn path_addresses(&self) -> lvk::Result<PathAddresses> {
        self.passes.light().addresses()
    }

    /// Address of the plane that the picture is made of.
    pub(crate) fn picture_address(&self) -> lvk::Result<u64> {
        Ok(self.planes.address()? + SHOWN * plane_bytes(self.extent))
    }

    /// The buffer of all planes.
    pub(crate) fn planes(&self) -> BufferHandle {
        *self.planes
    }

    /// Bytes from the beginning of the planes to the one that the picture is made of.
    pub(crate) fn picture_offset(&self) -> u64 {
        SHOWN * plane_bytes(self.extent)
    }

    /// Indices of the textures with the visible triangles, and the address of the pyramid.
    pub(crate) fn visibility(&self) -> lvk::Result<VisibilityConstants> {
        self.visibility.as_ref().map_or(Ok(VisibilityConstants::NONE), Visibility::constants)
    }

    /// What a frame's constants say of the radiance cache.
    pub(crate) fn cache(&self) -> lvk::Result<CacheConstants> {
        self.cache.as_ref().map_or(Ok(CacheConstants::NONE), RadianceCache::constants)
    }

    /// Address of what the ambient probe has found; 0 without one.
    pub(crate) fn ambient_sums(&self) -> lvk::Result<u64> {
        self.ambient.as_ref().map_or(Ok(0), AmbientProbe::address)
    }

    /// Leaves out what others hide, or no longer.
    pub(crate) fn set_occlusion(&mut self, ctx: &Context, is_on: bool) -> lvk::Result<()> {
        self.visibility.as_mut().map_or(Ok(()), |visibility| visibility.set_occlusion(ctx, is_on))
    }

    /// Records a frame.
    pub(crate) fn record(
        &self,
        to: &mut Frame<'_>,
        work: PathWork,
        scene: FrameScene<'_>,
        change: FrameChange,
    ) -> lvk::Result<()> {
        let frame = work.frame;
        let push = |argument| Push { frame, argument, _padding: 0 };
        let mut visible = Vec::new();
        if let Some(visibility) = &self.visibility {
            visibility.record(to, frame, scene)?;
            visible = visibility.textures();
        }
        let planes = *self.planes;
        let mut own = vec![planes];
        if let Some(cache) = &self.cache {
            own.push(cache.table());
            if change == FrameChange::All {
                to.pass("cache", |cmd| cache.clear(cmd))?;
            }
        }
        if let Some(probe) = &self.ambient {
            own.push(probe.sums());
            if change != FrameChange::None {
                to.pass("ambient probe", |cmd| probe.record(cmd, frame, scene))?;
            }
        }
        to.pass("light", |cmd| self.passes.light().record(cmd, work, &own, (&visible, scene)))?;
        if let Some(cache) = &self.cache {
            to.pass("cache", |cmd| cache.record(cmd, &push(0)))?;
        }
        to.pass("filters", |cmd| self.passes.record_filters(cmd, push, planes, self.extent))?;
        match self.passes.counts_steps() {
            true => {
                to.pass("steps", |cmd| self.passes.record_steps(cmd, &push(0), planes, scene, self.extent))
            }
            false => Ok(()),
        }
    }
}

fn plane_bytes([width, height]: [u32; 2]) -> u64 {
    ELEMENT * u64::from(width) * u64::from(height)
}
