//! Resources: one file for each kind of object, with its description, creation and end.

pub(crate) mod buffer;
pub(crate) mod image;
pub(crate) mod query;
pub(crate) mod query_marks;
pub(crate) mod sampler;
pub(crate) mod texture;
pub(crate) mod texture_desc;
pub(crate) mod view;

pub(crate) use buffer::Buffer;
pub(crate) use query::QueryPool;
pub(crate) use sampler::Sampler;
pub(crate) use texture::Texture;
