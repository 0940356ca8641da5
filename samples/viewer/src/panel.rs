//! What the panel of the window shows of the viewer.

use clap::ValueEnum as _;
use egui::{Color32, RichText};
use lvk_gltf::Animation;

use crate::config::{
    Content, CullingMode, IndirectLight, LightRate, Method, PrimaryVisibility, ToneMapping, ViewerConfig,
};
use crate::gpu::{DrawnInstances, TextureMemory};
use crate::model::ModelCamera;

/// Lays out the name of the model, and why the last file that was dropped is not shown, if so.
pub(crate) fn show_model(ui: &mut egui::Ui, name: &str, drop_error: Option<&str>) {
    ui.label(format!("{name} (drop another glTF or OBJ file here)"));
    show_error(ui, drop_error);
}

/// Lays out an error, if there is one.
pub(crate) fn show_error(ui: &mut egui::Ui, error: Option<&str>) {
    if let Some(error) = error {
        ui.label(RichText::new(error).color(Color32::LIGHT_RED));
    }
}

/// Lays out how many instances a frame some time ago has rasterised.
pub(crate) fn show_drawn(ui: &mut egui::Ui, drawn: Option<DrawnInstances>) {
    if let Some(DrawnInstances { count, triangle_count, in_frustum }) = drawn {
        ui.label(format!(
            "{count} instances rasterised ({triangle_count} triangles), {in_frustum} in the frustum"
        ));
    }
}

/// Lays out the memory of the structures of meshes and of the top level, in bytes.
pub(crate) fn show_memory(ui: &mut egui::Ui, bytes: [u64; 2]) {
    let [meshes, top] = bytes.map(|bytes| bytes as f64 / 1024.0 / 1024.0);
    ui.label(format!("structures: {meshes:.2} MiB of meshes, {top:.2} MiB of the top level"));
}

/// Lays out the memory of textures, if it is bounded.
pub(crate) fn show_textures(ui: &mut egui::Ui, memory: Option<TextureMemory>) {
    let Some(TextureMemory { budget, resident, coarse_count }) = memory else { return };
    let [budget, resident] = [budget, resident].map(|bytes| bytes as f64 / 1024.0 / 1024.0);
    ui.label(format!("textures: {resident:.1} of {budget:.1} MiB; {coarse_count} coarser than seen"));
}

/// Lays out the list of animations. Returns another choice than `chosen`.
pub(crate) fn choose_animation(
    ui: &mut egui::Ui,
    animations: &[Animation],
    chosen: Option<usize>,
) -> Option<Option<usize>> {
    if animations.is_empty() {
        return None;
    }
    let name = |place: Option<usize>| match place.and_then(|place| Some((place, animations.get(place)?))) {
        Some((place, animation)) => {
            animation.name.clone().unwrap_or_else(|| format!("animation {}", place + 1))
        }
        None => "none".to_owned(),
    };
    let mut choice = chosen;
    egui::ComboBox::from_label("plays").selected_text(name(chosen)).show_ui(ui, |ui| {
        for place in std::iter::once(None).chain((0..animations.len()).map(Some)) {
            ui.selectable_value(&mut choice, place, name(place));
        }
    });
    (choice != chosen).then_some(choice)
}

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

/// Lays out the settings that can change while the sample runs. `counts_steps`: the device counts steps of rays.
pub(crate) fn show_settings(ui: &mut egui::Ui, config: &mut ViewerConfig, counts_steps: bool) {
    ui.horizontal(|ui| {
        ui.selectable_value(&mut config.method, Method::Hybrid, "hybrid");
        ui.selectable_value(&mut config.method, Method::PathTrace, "path tracer");
    });
    if config.method == Method::Hybrid {
        egui::ComboBox::from_label("view").selected_text(format!("{:?}", config.content)).show_ui(ui, |ui| {
            for content in Content::value_variants() {
                // Where the device counts no steps, their view is black.
                let is_enabled = counts_steps || *content != Content::Steps;
                let name = format!("{content:?}");
                ui.add_enabled_ui(is_enabled, |ui| ui.selectable_value(&mut config.content, *content, name))
                    .response
                    .on_disabled_hover_text("ray queries in software count steps: --rt software");
            }
        });
    }
    if config.method == Method::Hybrid {
        ui.horizontal(|ui| {
            ui.label("primary visibility");
            ui.selectable_value(&mut config.primary, PrimaryVisibility::Rays, "rays");
            ui.selectable_value(&mut config.primary, PrimaryVisibility::Raster, "raster");
        });
        ui.horizontal(|ui| {
            ui.label("indirect light");
            ui.selectable_value(&mut config.indirect, IndirectLight::Cache, "cache");
            ui.selectable_value(&mut config.indirect, IndirectLight::Paths, "paths");
            ui.selectable_value(&mut config.indirect, IndirectLight::AmbientOcclusion, "ambient occlusion");
        });
        ui.horizontal(|ui| {
            ui.label("light rate");
            ui.selectable_value(&mut config.light_rate, LightRate::Full, "full");
            ui.selectable_value(&mut config.light_rate, LightRate::Quarter, "quarter");
        });
    }
    if config.rasterises() {
        egui::ComboBox::from_label("culling").selected_text(format!("{:?}", config.culling)).show_ui(
            ui,
            |ui| {
                for culling in
                    [CullingMode::Auto, CullingMode::None, CullingMode::Frustum, CullingMode::Occlusion]
                {
                    ui.selectable_value(&mut config.culling, culling, format!("{culling:?}"));
                }
            },
        );
    }
    ui.add(egui::Slider::new(&mut config.exposure_stops, -6.0..=6.0).text("stops"));
    ui.add(egui::Slider::new(&mut config.bounces, 1..=64).text("bounces"));
    ui.horizontal(|ui| {
        ui.selectable_value(&mut config.tone_mapping, ToneMapping::Neutral, "neutral");
        ui.selectable_value(&mut config.tone_mapping, ToneMapping::Linear, "linear");
    });
}
