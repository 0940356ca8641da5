//! The sample as an animation.

use crate::app::run_error::RunError;
use lvk::{Context, TextureHandle};

use super::{HybridOit, HybridOitConfig, NodeUse, PERIOD_SECONDS};
use crate::app::frame::Frame;
use crate::app::sample::{FrameTime, Sample};
use crate::app::ui::PendingSettings;
use crate::scene::Camera;

/// The sample in an animation.
pub struct HybridOitSequence {
    sample: HybridOit,
    /// Time that frame 0 shows, in seconds.
    start: f64,
    /// Time since then, in seconds.
    gone: f64,
    /// The camera of the scene.
    camera: Camera,
    /// Node use of the frame that asked for most.
    nodes: NodeUse,
    wanted: PendingSettings<HybridOitConfig>,
}

impl HybridOitSequence {
    /// An animation of `sample` whose frame 0 shows what is there after `start` seconds.
    #[must_use]
    pub fn new(sample: HybridOit, start: f64) -> Self {
        Self {
            camera: *sample.camera(),
            wanted: PendingSettings::new(*sample.config()),
            sample,
            start: if start.is_finite() { start.rem_euclid(PERIOD_SECONDS) } else { 0.0 },
            gone: 0.0,
            nodes: NodeUse::default(),
        }
    }

    /// Settings of the panel, which take effect with the next frame.
    pub fn wanted(&mut self) -> &mut HybridOitConfig {
        &mut self.wanted.config
    }

    fn pose(&mut self) {
        self.sample.update(self.start + self.gone);
    }
}

impl Sample for HybridOitSequence {
    fn context(&self) -> &Context {
        self.sample.context()
    }

    fn update(&mut self, time: FrameTime) {
        self.gone = PERIOD_SECONDS * f64::from(time.phase());
        self.pose();
        self.sample.set_camera(&self.camera);
    }

    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, RunError> {
        if let Some(config) = self.wanted.changed_from(*self.sample.config()) {
            let done = self.sample.change(&config);
            self.wanted.finish(done, *self.sample.config());
        }
        Ok(self.sample.record(frame)?)
    }

    fn after_frame(&mut self) -> Result<(), RunError> {
        let nodes = self.sample.node_use()?;
        self.nodes = if nodes.asked >= self.nodes.asked { nodes } else { self.nodes };
        Ok(())
    }

    fn resize(&mut self, extent: [u32; 2]) -> Result<(), RunError> {
        self.sample.resize(extent)?;
        [self.wanted.config.width, self.wanted.config.height] = extent;
        Ok(())
    }

    fn view(&mut self) -> Option<Camera> {
        Some(*self.sample.camera())
    }

    fn set_view(&mut self, camera: &Camera) {
        self.sample.set_camera(camera);
    }

    #[cfg(feature = "window")]
    fn panel(&mut self, ui: &mut egui::Ui) {
        let can_be = |config: &HybridOitConfig| self.sample.can_be(config);
        self.wanted.show(ui, |ui, config| show_switches(ui, config, can_be));
        let start = egui::Slider::new(&mut self.start, 0.0..=PERIOD_SECONDS);
        if ui.add(start.text("seconds ahead").fixed_decimals(1)).changed() {
            self.pose();
        }
    }

    fn reload(&mut self) -> Result<(), RunError> {
        Ok(self.sample.reload()?)
    }

    fn remark(&self) -> Result<Option<String>, RunError> {
        Ok(Some(format!("glass     {}", self.nodes)))
    }
}

#[cfg(feature = "window")]
fn show_switches(ui: &mut egui::Ui, config: &mut HybridOitConfig, can_be: impl Fn(&HybridOitConfig) -> bool) {
    let before = *config;
    crate::hybrid::path_switch(ui, &mut config.path, |path| can_be(&HybridOitConfig { path, ..before }));
    let most = HybridOitConfig::MAX_SUPERSAMPLING;
    ui.add(egui::Slider::new(&mut config.supersampling, 1..=most).text("samples a side of a pixel"));
    let most = HybridOitConfig::MAX_SHADOW_RAYS;
    ui.add(egui::Slider::new(&mut config.shadow_rays, 1..=most).text("shadow rays a sample"));
    let mut is_bounded = config.node_capacity.is_some();
    ui.checkbox(&mut is_bounded, "so many nodes for glass:");
    let (mut nodes, usual) = (config.nodes(), HybridOitConfig { node_capacity: None, ..*config }.nodes());
    let slider = egui::Slider::new(&mut nodes, 0..=usual.max(config.nodes())).logarithmic(true).text("nodes");
    ui.add_enabled(is_bounded, slider);
    config.node_capacity = is_bounded.then_some(nodes);
}
