//! Models: from a glTF or an OBJ file, or the one that needs no file.

mod cameras;
mod load;
mod obj;
mod posed;
mod showcase;
mod showcase_textures;

pub use cameras::{ModelCamera, cameras};
pub use load::{ModelError, load};
pub use posed::posed;
pub use showcase::showcase;
