//! The render targets of the sample.

use crate::app::sample_error::SampleError;
use lvk::{
    ColorAttachment, ColorLoadOp, Context, DepthAttachment, Holder, TextureDesc, TextureHandle,
    TextureMemory, TextureUsage,
};

use super::Passes;
use super::pipelines::{COLORS, DEPTH};

/// Names of the targets, in the order of [`COLORS`].
const NAMES: [&str; 4] = ["albedo and roughness", "normal and metalness", "light", "picture"];

/// The targets. In one pass all but the picture come and go with it.
pub(super) struct Targets {
    /// Targets in the order of [`COLORS`].
    pub(super) colors: [Holder<TextureHandle>; 4],
    pub(super) depth: Holder<TextureHandle>,
    one_pass: bool,
}

impl Targets {
    pub(super) fn new(ctx: &Context, passes: Passes, extent: [u32; 2]) -> Result<Self, SampleError> {
        SampleError::check_size(extent, ctx.capabilities())?;
        let one_pass = passes == Passes::One;
        let (usage, memory) = match passes {
            Passes::One => (TextureUsage::TARGET | TextureUsage::INPUT, TextureMemory::Transient),
            Passes::Several => (TextureUsage::TARGET | TextureUsage::SAMPLED, TextureMemory::Device),
        };
        let within = |format, debug_name| {
            let desc = TextureDesc { format, extent, usage, memory, debug_name, ..TextureDesc::default() };
            ctx.create_texture(&desc)
        };
        let picture = ctx.create_texture(&TextureDesc {
            format: COLORS[3],
            extent,
            usage: TextureUsage::TARGET | TextureUsage::SAMPLED,
            debug_name: NAMES[3],
            ..TextureDesc::default()
        })?;
        let [albedo, normal, light] = [0, 1, 2].map(|place| within(COLORS[place], NAMES[place]));
        Ok(Self { colors: [albedo?, normal?, light?, picture], depth: within(DEPTH, "depth")?, one_pass })
    }

    /// The picture as [`Sample::record`](crate::app::sample::Sample::record) answers it.
    pub(super) fn picture(&self) -> TextureHandle {
        *self.colors[3]
    }

    /// The targets of these places, as the first pass begins that draws to them.
    pub(super) fn begun(&self, places: std::ops::Range<usize>) -> Vec<ColorAttachment> {
        let attachment = |place: usize| {
            let cleared = ColorAttachment::clear(*self.colors[place], [0.0; 4]);
            match place {
                3 => ColorAttachment { load: ColorLoadOp::DontCare, ..cleared },
                _ => ColorAttachment { store: !self.one_pass, ..cleared },
            }
        };
        places.map(attachment).collect()
    }

    /// The light of surfaces so far.
    pub(super) fn light(&self) -> ColorAttachment {
        ColorAttachment { load: ColorLoadOp::Load, ..ColorAttachment::clear(*self.colors[2], [0.0; 4]) }
    }

    /// Depth as the first pass begins.
    pub(super) fn far_away(&self) -> DepthAttachment {
        let store = !self.one_pass;
        DepthAttachment { store, stencil_store: false, ..DepthAttachment::clear(*self.depth, 0.0) }
    }
}
