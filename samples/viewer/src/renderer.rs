//! Either method, with its data for pictures of one size.

use lvk::{BufferHandle, Context, Holder};
use lvk_samples::app::array_buffer::buffer;
use lvk_samples::app::frame::Frame;

use crate::config::{Method, ViewerConfig};
use crate::gpu::layout::VisibilityConstants;
use crate::gpu::{FrameChange, FrameScene};
use crate::hybrid::{CacheConstants, Hybrid};
use crate::path_pass::{PathAddresses, PathPass, PathWork};
use crate::pipelines::PATHS;

/// Either method.
pub(crate) enum Renderer {
    Hybrid(Box<Hybrid>),
    PathTrace { paths: PathPass, sums: Holder<BufferHandle> },
}

/// Addresses and indices of a method's data.
pub(crate) struct Addresses {
    pub(crate) sums: u64,
    pub(crate) planes: u64,
    pub(crate) paths: PathAddresses,
    pub(crate) visibility: VisibilityConstants,
    pub(crate) cache: CacheConstants,
    pub(crate) ambient_sums: u64,
}

impl Renderer {
    /// The method of a configuration. `occludes`: culling leaves out what others hide.
    pub(crate) fn new(ctx: &Context, config: &ViewerConfig, occludes: bool) -> lvk::Result<Self> {
        let [width, height] = config.extent();
        Ok(match config.method {
            Method::Hybrid => Self::Hybrid(Box::new(Hybrid::new(ctx, config, occludes)?)),
            Method::PathTrace => Self::PathTrace {
                paths: PathPass::new(ctx, config, &PATHS)?,
                sums: buffer(ctx, "sums", 16 * u64::from(width) * u64::from(height))?,
            },
        })
    }

    pub(crate) fn addresses(&self) -> lvk::Result<Addresses> {
        Ok(match self {
            Self::Hybrid(hybrid) => Addresses {
                sums: hybrid.picture_address()?,
                planes: hybrid.planes_address()?,
                paths: hybrid.path_addresses()?,
                visibility: hybrid.visibility()?,
                cache: hybrid.cache()?,
                ambient_sums: hybrid.ambient_sums()?,
            },
            Self::PathTrace { paths, sums } => {
                let (sums, paths) = (sums.address()?, paths.addresses()?);
                let visibility = VisibilityConstants::NONE;
                Addresses {
                    sums,
                    planes: sums,
                    paths,
                    visibility,
                    cache: CacheConstants::NONE,
                    ambient_sums: 0,
                }
            }
        })
    }

    /// Leaves out what others hide, or no longer, without beginning anew.
    pub(crate) fn set_occlusion(&mut self, ctx: &Context, is_on: bool) -> lvk::Result<()> {
        match self {
            Self::Hybrid(hybrid) => hybrid.set_occlusion(ctx, is_on),
            Self::PathTrace { .. } => Ok(()),
        }
    }

    /// The buffer that the picture is made of, and the bytes before its first pixel.
    pub(crate) fn sums(&self) -> (BufferHandle, u64) {
        match self {
            Self::Hybrid(hybrid) => (hybrid.planes(), hybrid.picture_offset()),
            Self::PathTrace { sums, .. } => (**sums, 0),
        }
    }

    /// Records a frame, or samples of the path tracer.
    pub(crate) fn record(
        &self,
        to: &mut Frame<'_>,
        work: PathWork,
        scene: FrameScene<'_>,
        change: FrameChange,
    ) -> lvk::Result<()> {
        match self {
            Self::Hybrid(hybrid) => hybrid.record(to, work, scene, change),
            Self::PathTrace { paths, sums } => {
                to.pass("paths", |cmd| paths.record(cmd, work, &[**sums], (&[], scene)))
            }
        }
    }
}
