//! The one bindless descriptor set.

pub(crate) mod layout;
pub(crate) mod slots;
pub(crate) mod table;

pub(crate) use table::{Bindless, Dummies, TextureViews};
