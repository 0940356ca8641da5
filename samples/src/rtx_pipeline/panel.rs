//! Settings in the panel of the window.

/// Settings that can change while the sample runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RtxPipelineSettings {
    /// Largest number of reflections and refractions, 0 to the depth of the [configuration](super::RtxPipelineConfig).
    pub depth: u32,
    /// Number of lights that shine, each with a shadow ray: the lamp, then the sun where there is one.
    pub lights: u32,
}

impl RtxPipelineSettings {
    /// Lays them out; `most` is what they begin with.
    #[cfg(feature = "window")]
    pub(super) fn show(&mut self, ui: &mut egui::Ui, most: &Self) {
        ui.add(egui::Slider::new(&mut self.depth, 0..=most.depth).text("mirrored or bent"));
        ui.add(egui::Slider::new(&mut self.lights, 0..=most.lights).text("lights"));
    }
}
