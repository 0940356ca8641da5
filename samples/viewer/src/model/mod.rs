//! Models: from a glTF or an OBJ file, or the one that needs no file.

mod cameras;
mod load;
mod obj;
mod showcase;
mod showcase_textures;

pub use cameras::{ModelCamera, cameras};
pub use load::{ModelError, load};
pub use showcase::showcase;
