//! The one bindless descriptor set.

mod array;
pub(crate) mod checks;
pub(crate) mod inputs;
pub(crate) mod layout;
mod room;
pub(crate) mod slots;
pub(crate) mod table;
mod yuv;

pub(crate) use table::{Bindless, Dummies, TEXTURE_ARRAYS, TextureViews};
pub(crate) use yuv::YuvSlots;
