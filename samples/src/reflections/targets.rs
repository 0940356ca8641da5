//! The pictures that the passes hand to each other.

use std::ops::Deref;

use lvk::{
    BufferHandle, CommandBuffer, Context, Format, Holder, TextureDesc, TextureHandle, TextureUsage,
    TransientHeap, TransientHeapDesc, TransientTexture,
};

use super::frame::Indices;
use crate::app::array_buffer::buffer;

/// Normals, colour, roughness and material of a g-buffer (`shaders/reflections/gbuffer.glsl`).
pub(super) const SURFACE_FORMAT: Format = Format::Rgba32Uint;
/// Depth, which counts down from 1 at the near plane.
pub(super) const DEPTH_FORMAT: Format = Format::D32Float;
/// Light before it is exposed.
pub(super) const COMPOSITE_FORMAT: Format = Format::Rgba16Float;

/// Steps of a sample of the image, in their order: textures whose steps do not overlap share memory.
pub(super) mod step {
    pub(in super::super) const SURFACES: u32 = 0;
    pub(in super::super) const TRANSPARENT_RAYS: u32 = 1;
    pub(in super::super) const OPAQUE_RAYS: u32 = 2;
    pub(in super::super) const SMOOTH: u32 = 3;
    pub(in super::super) const FILTER: u32 = 4;
    pub(in super::super) const COMPOSITE: u32 = 5;
    pub(in super::super) const BLEND: u32 = 6;
    pub(in super::super) const RESOLVE: u32 = 7;
}

/// A texture of the heap.
pub(super) struct Target {
    handle: TextureHandle,
    index: u32,
}

impl Target {
    pub(super) fn handle(&self) -> TextureHandle {
        self.handle
    }

    /// The bindless index.
    pub(super) fn index(&self) -> u32 {
        self.index
    }
}

impl Deref for Target {
    type Target = TextureHandle;

    fn deref(&self) -> &TextureHandle {
        &self.handle
    }
}

/// One texel a pixel in each.
pub(super) struct Targets {
    /// Owns all textures but the picture.
    pub(super) heap: TransientHeap,
    pub(super) opaque_surface: Target,
    pub(super) opaque_depth: Target,
    pub(super) glass_surface: Target,
    pub(super) glass_depth: Target,
    /// Visibility of each light, and ambient visibility.
    pub(super) visibility: Target,
    /// The same on its way through the filter.
    pub(super) smoothed: Target,
    /// Half the width of each light's penumbra, in pixels.
    pub(super) penumbra: Target,
    /// Reflected radiance and the distance of what is reflected.
    pub(super) reflection: Target,
    pub(super) filtered: Target,
    pub(super) glass_reflection: Target,
    pub(super) composite: Target,
    /// The image, sRGB.
    pub(super) picture: Holder<TextureHandle>,
    /// The sums of the samples.
    pub(super) sums: Holder<BufferHandle>,
    pub(super) sums_address: u64,
    pub(super) extent: [u32; 2],
}

impl Targets {
    pub(super) fn new(ctx: &Context, extent: [u32; 2]) -> lvk::Result<Self> {
        let heap = ctx.create_transient_heap(&TransientHeapDesc {
            textures: &transient_textures(extent),
            debug_name: "reflections' targets",
            ..TransientHeapDesc::default()
        })?;
        let at = |number: usize| {
            let texture = &heap.textures()[number];
            Target { handle: texture.handle(), index: texture.index() }
        };
        let size_bytes = u64::from(extent[0]) * u64::from(extent[1]) * size_of::<[f32; 4]>() as u64;
        let sums = buffer(ctx, "sums", size_bytes)?;
        let picture = TextureDesc {
            usage: TextureUsage::STORAGE | TextureUsage::SAMPLED,
            ..described(Format::Rgba8Unorm, extent, "picture")
        };
        Ok(Self {
            opaque_surface: at(0),
            opaque_depth: at(1),
            glass_surface: at(2),
            glass_depth: at(3),
            visibility: at(4),
            smoothed: at(5),
            penumbra: at(6),
            reflection: at(7),
            filtered: at(8),
            glass_reflection: at(9),
            composite: at(10),
            heap,
            picture: ctx.create_texture(&picture)?,
            sums_address: sums.address()?,
            sums,
            extent,
        })
    }

    /// Begins a step of [`step`].
    pub(super) fn begin(&self, cmd: &mut CommandBuffer, step: u32) -> lvk::Result<()> {
        cmd.begin_transient_step(&self.heap, step)
    }

    /// Tells the shaders where the targets are.
    pub(super) fn name_in(&self, indices: &mut Indices) {
        indices.opaque_surface = self.opaque_surface.index();
        indices.opaque_depth = self.opaque_depth.index();
        indices.glass_surface = self.glass_surface.index();
        indices.glass_depth = self.glass_depth.index();
        indices.visibility = self.visibility.index();
        indices.smoothed = self.smoothed.index();
        indices.penumbra = self.penumbra.index();
        indices.reflection = self.reflection.index();
        indices.filtered = self.filtered.index();
        indices.glass_reflection = self.glass_reflection.index();
        indices.composite = self.composite.index();
        indices.picture = self.picture.index();
    }

    /// The g-buffer of opaque surfaces.
    pub(super) fn opaque(&self) -> [TextureHandle; 2] {
        [*self.opaque_surface, *self.opaque_depth]
    }

    /// The g-buffer of transparent surfaces.
    pub(super) fn glass(&self) -> [TextureHandle; 2] {
        [*self.glass_surface, *self.glass_depth]
    }
}

fn described(format: Format, extent: [u32; 2], debug_name: &str) -> TextureDesc<'_> {
    TextureDesc { format, extent, debug_name, ..TextureDesc::default() }
}

/// The textures of the heap with the steps that write and read them, in the order of the fields of [`Targets`].
fn transient_textures(extent: [u32; 2]) -> [TransientTexture<'static>; 11] {
    const LIGHT_FORMAT: Format = Format::Rgba16Float;
    let (drawn, stored) = (TextureUsage::TARGET, TextureUsage::STORAGE);
    [
        ("opaque surface", SURFACE_FORMAT, drawn, step::SURFACES..=step::COMPOSITE),
        ("opaque depth", DEPTH_FORMAT, drawn, step::SURFACES..=step::BLEND),
        ("glass surface", SURFACE_FORMAT, drawn, step::SURFACES..=step::TRANSPARENT_RAYS),
        ("glass depth", DEPTH_FORMAT, drawn, step::SURFACES..=step::BLEND),
        ("visibility", LIGHT_FORMAT, stored, step::OPAQUE_RAYS..=step::COMPOSITE),
        ("smoothed visibility", LIGHT_FORMAT, stored, step::SMOOTH..=step::SMOOTH),
        ("penumbra", LIGHT_FORMAT, stored, step::OPAQUE_RAYS..=step::SMOOTH),
        ("reflection", LIGHT_FORMAT, stored, step::OPAQUE_RAYS..=step::COMPOSITE),
        ("filtered reflection", LIGHT_FORMAT, stored, step::FILTER..=step::FILTER),
        ("glass reflection", LIGHT_FORMAT, stored, step::TRANSPARENT_RAYS..=step::BLEND),
        ("composite", COMPOSITE_FORMAT, stored | drawn, step::COMPOSITE..=step::RESOLVE),
    ]
    .map(|(name, format, usage, steps)| TransientTexture {
        desc: TextureDesc { usage: usage | TextureUsage::SAMPLED, ..described(format, extent, name) },
        first_step: *steps.start(),
        last_step: *steps.end(),
    })
}
