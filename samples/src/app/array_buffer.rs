//! Creates buffers of plain elements.

use lvk::{BufferDesc, BufferHandle, BufferUsage, Context, Holder};

/// Creates a storage buffer of `size_bytes` bytes.
///
/// # Errors
/// Those of [`Context::create_buffer`].
pub fn buffer(ctx: &Context, debug_name: &str, size_bytes: u64) -> lvk::Result<Holder<BufferHandle>> {
    ctx.create_buffer(&BufferDesc { size_bytes, debug_name, ..BufferDesc::default() })
}

/// Creates a buffer that holds `elements`, of which there is at least one.
///
/// # Errors
/// Those of [`Context::create_buffer`].
pub fn array<T: bytemuck::NoUninit>(
    ctx: &Context,
    debug_name: &str,
    usage: BufferUsage,
    elements: &[T],
) -> lvk::Result<Holder<BufferHandle>> {
    let data = bytemuck::cast_slice(elements);
    ctx.create_buffer(&BufferDesc { usage, data: Some(data), debug_name, ..BufferDesc::default() })
}
