//! Switches in the panel of the window.

use crate::config::{Method, Shown, ToneMapping, ViewerConfig};
use crate::model::ModelCamera;

/// Lays out the list of cameras. Returns another choice than `chosen`.
pub(crate) fn choose_camera(ui: &mut egui::Ui, cameras: &[ModelCamera], chosen: usize) -> Option<usize> {
    let mut choice = chosen;
    let name = cameras.get(chosen).map_or("", |camera| &camera.name);
    egui::ComboBox::from_label("camera").selected_text(name).show_ui(ui, |ui| {
        for (place, camera) in cameras.iter().enumerate() {
            ui.selectable_value(&mut choice, place, &camera.name);
        }
    });
    (choice != chosen).then_some(choice)
}

/// Lays out the settings that can change while the sample runs.
pub(crate) fn show_settings(ui: &mut egui::Ui, config: &mut ViewerConfig) {
    ui.horizontal(|ui| {
        ui.selectable_value(&mut config.method, Method::Hybrid, "hybrid");
        ui.selectable_value(&mut config.method, Method::PathTrace, "path tracer");
    });
    if config.method == Method::Hybrid {
        egui::ComboBox::from_label("view").selected_text(format!("{:?}", config.shown)).show_ui(ui, |ui| {
            for shown in [
                Shown::Light,
                Shown::Normals,
                Shown::Roughness,
                Shown::Motion,
                Shown::Albedo,
                Shown::Matte,
                Shown::Mirrored,
            ] {
                ui.selectable_value(&mut config.shown, shown, format!("{shown:?}"));
            }
        });
    }
    ui.add(egui::Slider::new(&mut config.exposure_stops, -6.0..=6.0).text("stops"));
    ui.add(egui::Slider::new(&mut config.bounces, 1..=64).text("bounces"));
    ui.horizontal(|ui| {
        ui.selectable_value(&mut config.tone_mapping, ToneMapping::Neutral, "neutral");
        ui.selectable_value(&mut config.tone_mapping, ToneMapping::Linear, "linear");
    });
}
