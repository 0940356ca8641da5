//! Settings in the panel of the window.

use lvk::BuildMode;

use super::instances::GROUPS;

/// Refits of the top-level structure between two rebuilds.
const MAX_REFITS: u32 = 32;

/// The build mode of the TLAS.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TlasUpdate {
    /// Refits, and a rebuild after some of them.
    #[default]
    Both,
    /// Refits alone.
    Refits,
    /// A rebuild in every frame.
    Rebuilds,
}

/// Settings that can change while the sample runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RtxHelloSettings {
    /// True if rays see the triangle in the middle, the inner ring, and the outer one.
    pub is_seen: [bool; GROUPS],
    /// The build mode of the TLAS.
    pub following: TlasUpdate,
}

impl Default for RtxHelloSettings {
    fn default() -> Self {
        Self { is_seen: [true; GROUPS], following: TlasUpdate::default() }
    }
}

impl RtxHelloSettings {
    /// The mask of instances of a group.
    pub(super) fn mask(&self, group: usize) -> u8 {
        if self.is_seen[group] { 0xff } else { 0 }
    }

    pub(super) fn mode(&self) -> BuildMode {
        match self.following {
            TlasUpdate::Both => BuildMode::Auto { max_refits: MAX_REFITS },
            TlasUpdate::Refits => BuildMode::Refit,
            TlasUpdate::Rebuilds => BuildMode::Rebuild,
        }
    }

    /// Lays them out.
    #[cfg(feature = "window")]
    pub(super) fn show(&mut self, ui: &mut egui::Ui) {
        for (is_seen, name) in
            self.is_seen.iter_mut().zip(["triangle in the middle", "inner ring", "outer ring"])
        {
            ui.checkbox(is_seen, name);
        }
        ui.label("top-level structure");
        ui.horizontal(|ui| {
            ui.radio_value(&mut self.following, TlasUpdate::Both, "by policy");
            ui.radio_value(&mut self.following, TlasUpdate::Refits, "refitted");
            ui.radio_value(&mut self.following, TlasUpdate::Rebuilds, "rebuilt");
        });
    }
}
