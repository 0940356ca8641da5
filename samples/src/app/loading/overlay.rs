//! The progress of loading, in the middle of the window.

use std::time::Duration;

use egui::{Align2, ProgressBar, Ui};

use super::status::Stage;

/// Width of the bar, in points.
const WIDTH: f32 = 320.0;

/// Lays out what is being done, how much of it is, and since when anything is.
pub(super) fn show(ui: &egui::Context, stage: &Stage, elapsed: Duration) {
    let window = egui::Window::new("loading").anchor(Align2::CENTER_CENTER, [0.0; 2]);
    window.collapsible(false).resizable(false).default_width(WIDTH).show(ui, |ui| {
        ui.set_width(WIDTH);
        ui.label(&stage.name);
        show_share(ui, stage.share());
        ui.label(format!("{:.0} s", elapsed.as_secs_f32()));
    });
}

/// A progress bar, or a spinner where the total is unknown.
fn show_share(ui: &mut Ui, share: Option<f32>) {
    match share {
        Some(share) => ui.add(ProgressBar::new(share).show_percentage()),
        None => ui.spinner(),
    };
}
