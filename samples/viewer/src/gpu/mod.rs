//! A model on the GPU.

mod albedo_table;
mod culling;
mod deformation;
mod emitters;
mod geometry;
mod ignored;
mod instances;
pub(crate) mod layout;
mod lights;
mod materials;
mod motion;
mod scene;
mod textures;
mod vertices;

pub use culling::DrawnInstances;
pub(crate) use culling::{Culling, DrawnCounts};
pub(crate) use instances::Draw;
pub(crate) use scene::GpuScene;
pub use textures::TextureMemory;

/// What a frame rasterises and traces.
#[derive(Clone, Copy)]
pub(crate) struct FrameScene<'a> {
    /// Everything to rasterise.
    pub(crate) draws: &'a [Draw],
    /// The pass that leaves out instances; `None` to rasterise all.
    pub(crate) culling: Option<&'a Culling>,
    /// Buffers that commands before have written.
    pub(crate) written: &'a [lvk::BufferHandle],
    /// The buffer that shaders write the mip levels to that they want, if levels come and go.
    pub(crate) wanted_mips: Option<lvk::BufferHandle>,
}

impl FrameScene<'_> {
    /// Buffers that a pass writes which reads textures and writes `own`.
    pub(crate) fn buffers(&self, own: &[lvk::BufferHandle]) -> Vec<lvk::BufferHandle> {
        own.iter().copied().chain(self.wanted_mips).collect()
    }
}

/// The difference of a frame from the one before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FrameChange {
    /// Neither the place of the eye nor the scene; the samples or the direction of the camera may.
    None,
    /// The place of the eye, or of something in the scene.
    Place,
    /// Everything: no frame is known from before.
    All,
}
