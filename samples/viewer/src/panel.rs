//! Switches in the panel of the window.

use crate::config::{Content, Method, ToneMapping, ViewerConfig};
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
        egui::ComboBox::from_label("view").selected_text(format!("{:?}", config.content)).show_ui(ui, |ui| {
            for content in [
                Content::Light,
                Content::Normals,
                Content::Roughness,
                Content::Motion,
                Content::Albedo,
                Content::Matte,
                Content::Mirrored,
            ] {
                ui.selectable_value(&mut config.content, content, format!("{content:?}"));
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
