//! A model on the GPU.

mod albedo_table;
mod deformation;
mod emitters;
mod geometry;
mod instances;
pub(crate) mod layout;
mod lights;
mod materials;
mod motion;
mod scene;
mod textures;
mod vertices;

pub(crate) use instances::Draw;
pub(crate) use scene::GpuScene;

/// What a frame rasterises and traces.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FrameScene<'a> {
    /// Everything to rasterise.
    pub(crate) draws: &'a [Draw],
    /// Buffers that commands before have written.
    pub(crate) written: &'a [lvk::BufferHandle],
}
