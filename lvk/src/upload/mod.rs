//! Uploads from host memory to the GPU.

pub(crate) mod buffer_recycler;
pub(crate) mod copy_regions;
mod page_allocator;
pub(crate) mod pending;
pub(crate) mod staging;
mod staging_pool;

pub(crate) use buffer_recycler::BufferRecycler;
pub(crate) use pending::PendingUploads;
pub(crate) use staging::Staging;
