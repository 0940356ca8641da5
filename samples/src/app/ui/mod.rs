//! The user interface of windows: egui, painted by `lvk`.

mod atlas;
mod painter;
mod panel;

pub use painter::{Painter, pipelines};
pub use panel::{Panel, Told};
