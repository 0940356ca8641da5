//! Arrays of plain elements on the device.

use lvk::{BufferDesc, BufferHandle, BufferUsage, Context, Holder};

/// A buffer with these elements.
pub(crate) fn array<T: bytemuck::NoUninit>(
    ctx: &Context,
    debug_name: &str,
    usage: BufferUsage,
    elements: &[T],
) -> lvk::Result<Holder<BufferHandle>> {
    let data = bytemuck::cast_slice(elements);
    ctx.create_buffer(&BufferDesc { usage, data: Some(data), debug_name, ..BufferDesc::default() })
}
