#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod callback;
mod error;
mod meshes;
mod painter;
mod pipeline;
mod textures;

pub use callback::Callback;
pub use egui;
pub use error::{Error, Result};
pub use painter::{Painter, Screen};
pub use pipeline::Target;
pub use textures::{TexelEncoding, UserTexture};
