//! The one bindless descriptor set.

pub(crate) mod index_checks;
pub(crate) mod input_attachments;
pub(crate) mod layout;
pub(crate) mod slot_allocator;
mod slot_array;
pub(crate) mod table;
mod yuv_slots;

pub(crate) use table::{Bindless, DefaultDescriptors, TEXTURE_ARRAYS, TextureViews};
pub(crate) use yuv_slots::YuvSlots;
