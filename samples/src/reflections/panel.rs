//! Settings in the panel of the window.

use egui::{Slider, Ui};
use lvk::Capabilities;

use super::config::{ReflectionsConfig, SkinUpdate};
use crate::app::ui::option_button;
use crate::hybrid::path_switch;

/// Most samples that the slider offers: they are rendered one after the other, while a person waits.
const MOST_SAMPLES: u32 = 16;

/// Lays out the switches of `config`.
pub(super) fn show_settings(ui: &mut Ui, config: &mut ReflectionsConfig, capabilities: &Capabilities) {
    let before = *config;
    let can_be = |path| ReflectionsConfig { path, ..before }.check(capabilities).is_ok();
    path_switch(ui, &mut config.path, can_be);
    ui.add(Slider::new(&mut config.samples, 1..=MOST_SAMPLES.max(before.samples)).text("samples a pixel"));
    ui.horizontal(|ui| {
        ui.label("serpent");
        option_button(ui, &mut config.skin_update, "refitted", |_| SkinUpdate::Refit, |_| true);
        option_button(ui, &mut config.skin_update, "rebuilt", |_| SkinUpdate::Rebuild, |_| true);
    });
    ui.add(Slider::new(&mut config.min_angle, 0.0..=0.2_f32.max(before.min_angle)).text("least angle"));
}
