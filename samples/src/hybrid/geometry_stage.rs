//! The geometry stage, before the ray pass.

use lvk::{CommandBuffer, Context};

use super::config::{Geometry, HybridConfig, Method};
use super::frame::{Indices, Push, VisibilityAddresses};
use super::geometry_pass::GeometryPass;
use super::gpu_scene::GpuScene;
use super::raster_choice::RasterChoice;
use super::ray_pass::GeometryLeft;
use super::visibility_pass::VisibilityPass;

/// The geometry stage, before the ray pass.
pub(super) enum GeometryStage {
    None,
    Paper(GeometryPass),
    Visibility(Box<VisibilityPass>),
}

impl GeometryStage {
    /// Makes what `config` asks for.
    pub(super) fn new(ctx: &Context, scene: &GpuScene, config: &HybridConfig) -> lvk::Result<Self> {
        Ok(match (config.method, config.geometry) {
            (Method::Standalone, _) => Self::None,
            (Method::Hybrid, Geometry::Paper) => {
                Self::Paper(GeometryPass::new(ctx, scene, [config.width, config.height])?)
            }
            (Method::Hybrid, Geometry::Visibility(wish)) => {
                Self::Visibility(Box::new(VisibilityPass::new(ctx, scene.triangle_count, config, wish)?))
            }
        })
    }

    /// Records it.
    pub(super) fn record(&self, cmd: &mut CommandBuffer, push: &Push) -> lvk::Result<()> {
        match self {
            Self::None => Ok(()),
            Self::Paper(pass) => pass.record(cmd, push),
            Self::Visibility(pass) => pass.record(cmd, push),
        }
    }

    /// Resources that the stage leaves for the ray pass.
    pub(super) fn left(&self) -> GeometryLeft {
        match self {
            Self::None => GeometryLeft::default(),
            Self::Paper(pass) => {
                GeometryLeft { textures: pass.targets.textures().to_vec(), buffers: Vec::new() }
            }
            Self::Visibility(pass) => GeometryLeft { textures: pass.textures(), buffers: pass.buffers() },
        }
    }

    /// Addresses and indices for the shaders.
    pub(super) fn addresses(&self) -> VisibilityAddresses {
        match self {
            Self::Visibility(pass) => pass.addresses(),
            _ => bytemuck::Zeroable::zeroed(),
        }
    }

    /// Takes another rasteriser, which must be there.
    pub(super) fn choose(&mut self, choice: RasterChoice) {
        if let Self::Visibility(pass) = self {
            pass.choose(choice);
        }
    }

    /// The rasteriser in use, and the reason.
    pub(super) fn choice(&self) -> Option<RasterChoice> {
        match self {
            Self::Visibility(pass) => Some(pass.choice()),
            _ => None,
        }
    }

    /// True if there is a choice of rasterisers.
    pub(super) fn has_both(&self) -> bool {
        matches!(self, Self::Visibility(pass) if pass.has_both())
    }

    /// Tells the shaders where the targets are.
    pub(super) fn name_in(&self, indices: &mut Indices) {
        if let Self::Paper(pass) = self {
            pass.targets.name_in(indices);
        }
    }
}
