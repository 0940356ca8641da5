//! Models: from a glTF or an OBJ file, or the one that needs no file.

mod cameras;
mod load;
mod obj;
mod posed;
mod rig;
mod showcase;
mod showcase_textures;

pub use cameras::{ModelCamera, cameras};
pub(crate) use cameras::{bounds, cameras_around};
pub use load::{ModelError, load};
pub use posed::posed;
pub(crate) use posed::{moved, movers};
pub(crate) use rig::{deforms, rig};
pub use showcase::showcase;
