//! The user interface of windows: egui, painted by `lvk`.

mod atlas;
pub(crate) mod painter;

pub use painter::{Painter, pipelines};
