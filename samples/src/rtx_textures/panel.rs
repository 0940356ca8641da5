//! Settings in the panel of the window.

use super::renderer::{INSTANCE_COUNT, TEXTURES};

/// Settings that can change while the sample runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RtxTexturesSettings {
    /// Instances that the compute shader writes and rays see, from the ground on; at least 1, and no more than
    /// [`instance_count`](super::RtxTextures::instance_count).
    pub instances: u32,
    /// Number of things by which each texture is shifted.
    pub handed_on: u32,
    /// Colours between texels, and not those of the nearest ones.
    pub is_filtered: bool,
}

impl Default for RtxTexturesSettings {
    fn default() -> Self {
        Self { instances: INSTANCE_COUNT, handed_on: 0, is_filtered: true }
    }
}

impl RtxTexturesSettings {
    /// Number of instances in the next frame.
    pub(super) fn instance_count(&self) -> u32 {
        self.instances.clamp(1, INSTANCE_COUNT)
    }

    /// The textures in the order in which shaders find them.
    pub(super) fn ordered(&self, textures: &[u32; TEXTURES]) -> [u32; TEXTURES] {
        let mut ordered = *textures;
        ordered.rotate_right(self.handed_on as usize % TEXTURES);
        ordered
    }

    /// Lays them out.
    #[cfg(feature = "window")]
    pub(super) fn show(&mut self, ui: &mut egui::Ui) {
        ui.add(egui::Slider::new(&mut self.instances, 1..=INSTANCE_COUNT).text("instances"));
        ui.add(egui::Slider::new(&mut self.handed_on, 0..=TEXTURES as u32 - 1).text("textures handed on"));
        ui.checkbox(&mut self.is_filtered, "filtered textures");
    }
}
