//! What a command reaches through the bindless set or by address, beyond what its arguments say.

use crate::handle::{AccelStructHandle, BufferHandle, TextureHandle};
use crate::submit::SubmitHandle;

/// Names resources a draw, dispatch or trace reaches bindlessly, so that the library can place barriers.
///
/// Nothing needs to be declared for resources that were only uploaded: they are readable everywhere. Declare what an
/// earlier command wrote (storage images, buffers, render targets now sampled) and what this command writes.
/// What another queue wrote, copies included, is named by who reads it here, and so are textures that another queue copies
/// from meanwhile, and, where another queue used them last, textures with more usages than `SAMPLED`.
/// Acceleration structures need no declaration: the library reads from the shaders whether they trace rays, and lets a
/// render pass see what was built before it wherever a graphics pipeline queries rays.
#[derive(Debug, Clone, Copy, Default)]
pub struct Dependencies<'a> {
    /// Textures and views that are sampled or fetched: all their mips and layers.
    pub sampled_images: &'a [TextureHandle],
    /// Textures and views that are written or read as storage images: the first mip of each.
    pub storage_images: &'a [TextureHandle],
    /// Buffers that are written, or both read and written.
    pub buffers: &'a [BufferHandle],
    /// Buffers that are only read.
    pub read_buffers: &'a [BufferHandle],
    /// Acceleration structures that shaders query. Needed only by a render pass, in the same command buffer as the
    /// build, whose pipelines are made after it began.
    pub acceleration_structures: &'a [AccelStructHandle],
    /// Submissions, of whatever queue, that the whole command buffer begins after. Rarely needed: what is named above, and what
    /// commands name, is waited for without being told. They move no texture to this queue: those with more usages than `SAMPLED`
    /// are named above.
    pub wait_for: &'a [SubmitHandle],
}
