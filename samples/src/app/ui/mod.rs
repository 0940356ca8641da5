//! The user interface of windows: egui, painted by `lvk`.

mod atlas;
mod painter;
mod panel;
mod pending_settings;

pub use painter::{Painter, pipelines};
pub use panel::{Panel, PanelInfo};
pub use pending_settings::PendingSettings;
pub(crate) use pending_settings::option_button;
