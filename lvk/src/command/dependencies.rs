//! Resources that a command accesses through the bindless set or by address, beyond its arguments.

use crate::handle::{AccelStructHandle, BufferHandle, TextureHandle};
use crate::submit::SubmitHandle;

/// The resources that a draw, dispatch or trace accesses bindlessly and that a command writes, so that the library can
/// record barriers.
///
/// Resources that were only uploaded need no declaration: they are readable everywhere. Declare resources that an
/// earlier command wrote (storage images, buffers, render targets now sampled) and resources that this command writes.
/// Also declare resources that this command reads and another queue wrote, by copies too. The same holds for textures
/// that another queue copies from at the same time, and for textures with more usages than `SAMPLED` that another queue
/// used last. Acceleration structures need no declaration: the library detects from the shaders whether they trace
/// rays. If a graphics pipeline queries rays, a render pass sees the builds recorded before it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Dependencies<'a> {
    /// Textures and views that are sampled or fetched: all their mips and layers. Default: empty.
    pub sampled_images: &'a [TextureHandle],
    /// Textures and views that are written or read as storage images: the first mip of each. Default: empty.
    pub storage_images: &'a [TextureHandle],
    /// Buffers that are written, or both read and written. Default: empty.
    pub buffers: &'a [BufferHandle],
    /// Buffers that are only read. Default: empty.
    pub read_buffers: &'a [BufferHandle],
    /// Acceleration structures that shaders query. Needed only by a render pass in the same command buffer as the
    /// build, if the pass's pipelines are created after it began. Default: empty.
    pub acceleration_structures: &'a [AccelStructHandle],
    /// Submissions, of any queue, that the whole command buffer begins after. Rarely needed: the library waits by
    /// itself for the resources named above and for those that commands name. A submission listed here moves no texture
    /// to this queue: declare textures with more usages than `SAMPLED` above. Default: empty.
    pub wait_for: &'a [SubmitHandle],
}
