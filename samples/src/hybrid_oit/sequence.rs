//! The sample as an animation.

use lvk::{Context, TextureHandle};

use super::{HybridOit, HybridOitConfig, HybridOitError, NodeUse, PERIOD_SECONDS};
use crate::app::frame::Frame;
use crate::app::sample::{Moment, Sample};
use crate::scene::Camera;

/// The sample in an animation.
pub struct HybridOitSequence {
    sample: HybridOit,
    /// What frame 0 shows, in seconds.
    start: f64,
    /// Where the scene says that it is seen from.
    camera: Camera,
    /// Of the frame that asked for most.
    nodes: NodeUse,
}

impl HybridOitSequence {
    /// An animation of `sample` whose frame 0 shows what is there after `start` seconds.
    #[must_use]
    pub fn new(sample: HybridOit, start: f64) -> Self {
        Self { camera: *sample.camera(), sample, start, nodes: NodeUse::default() }
    }
}

impl Sample for HybridOitSequence {
    type Error = HybridOitError;

    fn context(&self) -> &Context {
        self.sample.context()
    }

    fn update(&mut self, moment: Moment) -> Result<(), HybridOitError> {
        self.sample.update(self.start + PERIOD_SECONDS * f64::from(moment.phase()));
        self.sample.look(&self.camera);
        Ok(())
    }

    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, HybridOitError> {
        self.sample.record(frame)
    }

    fn after_frame(&mut self) -> Result<(), HybridOitError> {
        let nodes = self.sample.node_use()?;
        self.nodes = if nodes.asked >= self.nodes.asked { nodes } else { self.nodes };
        Ok(())
    }

    fn resize(&mut self, extent: [u32; 2]) -> Result<(), HybridOitError> {
        self.sample.resize(extent)
    }

    fn view(&self) -> Option<Camera> {
        Some(*self.sample.camera())
    }

    fn set_view(&mut self, camera: &Camera) {
        self.sample.look(camera);
    }

    fn panel(&mut self, ui: &mut egui::Ui) {
        let most = HybridOitConfig::MAX_SHADOW_RAYS;
        ui.add(egui::Slider::new(self.sample.shadow_rays(), 1..=most).text("shadow rays a sample"));
    }

    fn reload(&mut self) -> Result<(), HybridOitError> {
        self.sample.reload()
    }

    fn remark(&self) -> Option<String> {
        Some(format!("glass     {}", self.nodes))
    }
}
