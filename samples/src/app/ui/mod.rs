//! The user interface of windows: egui, painted by `lvk-egui`.

#[cfg(feature = "window")]
mod panel;
mod pending_settings;

#[cfg(feature = "window")]
pub use panel::{Panel, PanelInfo};
pub use pending_settings::PendingSettings;
#[cfg(feature = "window")]
pub(crate) use pending_settings::option_button;
