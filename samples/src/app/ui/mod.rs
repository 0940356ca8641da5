//! The user interface of windows: egui, painted by `lvk`.

mod atlas;
mod painter;
mod panel;
mod wanted;

pub use painter::{Painter, pipelines};
pub use panel::{Panel, Told};
pub use wanted::Wanted;
pub(crate) use wanted::option;
