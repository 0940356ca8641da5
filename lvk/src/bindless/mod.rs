//! The one bindless descriptor set.

pub(crate) mod checks;
pub(crate) mod layout;
pub(crate) mod slots;
pub(crate) mod table;

pub(crate) use table::{Bindless, Dummies, TEXTURE_ARRAYS, TextureViews};
