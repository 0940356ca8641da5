//! Resources: one file for each kind of object, with its description, creation and destruction.

pub(crate) mod buffer;
pub(crate) mod format_support;
pub(crate) mod host_copy;
pub(crate) mod image;
mod image_check;
pub(crate) mod image_usage;
mod portability;
pub(crate) mod query_pool;
pub(crate) mod query_reset_state;
pub(crate) mod region;
pub(crate) mod sampler;
#[cfg(unix)]
pub(crate) mod sharing;
pub(crate) mod swizzle;
pub(crate) mod texture;
pub(crate) mod texture_desc;
pub(crate) mod transient_heap;
pub(crate) mod transient_images;
mod transient_packing;
pub(crate) mod view;
pub(crate) mod ycbcr;

pub(crate) use buffer::Buffer;
pub(crate) use image_check::check_image;
pub(crate) use query_pool::QueryPool;
pub(crate) use sampler::Sampler;
pub(crate) use texture::Texture;
