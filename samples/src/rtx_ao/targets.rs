//! The pictures that the passes hand to each other.

use lvk::{Context, Format, Holder, TextureDesc, TextureHandle, TextureUsage};

use super::frame::TargetIndices;
use crate::hybrid::RayPath;

pub(super) const ALBEDO: Format = Format::Rgba16Float;
/// Format of light, position and normals.
pub(super) const NUMBERS: Format = Format::Rgba32Float;
pub(super) const DEPTH: Format = Format::D32Float;

/// One texel a pixel in each.
pub(super) struct Targets {
    pub(super) depth: Holder<TextureHandle>,
    pub(super) albedo: Holder<TextureHandle>,
    pub(super) light: Holder<TextureHandle>,
    /// Position, shading normal and geometric normal, for rays by pipeline.
    pub(super) surface: Option<[Holder<TextureHandle>; 3]>,
}

impl Targets {
    pub(super) fn new(ctx: &Context, path: RayPath, extent: [u32; 2]) -> lvk::Result<Self> {
        let make = |format, usage, debug_name| {
            let usage = usage | TextureUsage::TARGET | TextureUsage::SAMPLED;
            ctx.create_texture(&TextureDesc { format, extent, usage, debug_name, ..TextureDesc::default() })
        };
        let target = |format, name| make(format, TextureUsage::empty(), name);
        let surface = || {
            Ok::<_, lvk::Error>([
                target(NUMBERS, "position")?,
                target(NUMBERS, "normal")?,
                target(NUMBERS, "geometric normal")?,
            ])
        };
        Ok(Self {
            depth: target(DEPTH, "depth")?,
            albedo: target(ALBEDO, "albedo")?,
            light: make(NUMBERS, TextureUsage::STORAGE, "light")?,
            surface: (path == RayPath::Pipeline).then(surface).transpose()?,
        })
    }

    pub(super) fn indices(&self) -> TargetIndices {
        let surface = |number: usize| self.surface.as_ref().map_or(0, |surface| surface[number].index());
        TargetIndices {
            albedo: self.albedo.index(),
            light: self.light.index(),
            position: surface(0),
            normal: surface(1),
            geometric: surface(2),
        }
    }

    /// Colour attachments of the surface pass, in the order of its outputs.
    pub(super) fn colors(&self) -> Vec<TextureHandle> {
        match &self.surface {
            Some([position, normal, geometric]) => {
                [&self.albedo, position, normal, geometric].map(Holder::handle).to_vec()
            }
            None => [&self.albedo, &self.light].map(Holder::handle).to_vec(),
        }
    }
}
