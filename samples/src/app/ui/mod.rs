//! The user interface of windows: egui, painted by `lvk-egui`.

mod panel;
mod pending_settings;

pub use panel::{Panel, PanelInfo};
pub use pending_settings::PendingSettings;
pub(crate) use pending_settings::option_button;
