//! The panel of a window: switches, times of the GPU, keys.

use egui::{CollapsingHeader, Color32, Grid, RichText, Ui};
use lvk::{GpuProfile, GpuScope, PresentMode};

/// The panel that all windows have.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// True if it is seen.
    pub is_open: bool,
    /// True if the animation goes on.
    pub animates: bool,
    /// The present mode.
    pub present_mode: PresentMode,
    /// Error of the shaders on disk, if they do not compile.
    pub shader_error: Option<String>,
    /// Milliseconds from frame to frame, smoothed.
    frame_ms: f32,
}

/// Values that a panel displays.
pub struct PanelInfo<'a> {
    /// Name of the device.
    pub device: &'a str,
    /// Size of the window in pixels.
    pub extent: [u32; 2],
    /// The present modes that the device supports.
    pub present_modes: &'a [PresentMode],
    /// GPU times.
    pub profile: Option<&'a GpuProfile>,
    /// Keys and what they do.
    pub keys: &'a [(&'a str, &'a str)],
}

/// A line of the tree of times.
#[derive(Debug, Clone, PartialEq)]
struct Row {
    depth: usize,
    name: String,
    ms: f64,
}

impl Panel {
    /// Share of the latest frame in the smoothed time.
    const NEWS: f32 = 0.05;

    /// Open, of an animation that goes on.
    #[must_use]
    pub fn new(present_mode: PresentMode) -> Self {
        Self { is_open: true, animates: true, present_mode, shader_error: None, frame_ms: 0.0 }
    }

    /// A frame took so long.
    pub fn count_frame(&mut self, seconds: f32) {
        let news = if self.frame_ms == 0.0 { 1.0 } else { Self::NEWS };
        self.frame_ms += news * (1e3 * seconds - self.frame_ms);
    }

    /// Lays itself out, with the sample's own switches in it.
    pub fn show(
        &mut self,
        ui: &egui::Context,
        title: &str,
        info: &PanelInfo<'_>,
        switches: impl FnOnce(&mut Ui),
    ) {
        if !self.is_open {
            return;
        }
        egui::Window::new(title).default_pos([8.0, 8.0]).default_width(250.0).show(ui, |ui| {
            let [width, height] = info.extent;
            let rate = 1e3 / self.frame_ms.max(1e-3);
            ui.label(info.device);
            ui.label(format!("{width} x {height}, {:.1} ms, {rate:.0} a second", self.frame_ms));
            if let Some(error) = &self.shader_error {
                ui.label(RichText::new(error).color(Color32::LIGHT_RED).monospace());
            }
            ui.checkbox(&mut self.animates, "animation");
            self.show_modes(ui, info.present_modes);
            switches(ui);
            CollapsingHeader::new("GPU time").default_open(true).show(ui, |ui| match info.profile {
                Some(profile) => show_times(ui, profile),
                None => drop(ui.label("none known")),
            });
            CollapsingHeader::new("Keys").show(ui, |ui| show_keys(ui, info.keys));
        });
    }

    fn show_modes(&mut self, ui: &mut Ui, modes: &[PresentMode]) {
        let name = |mode| format!("{mode:?}");
        egui::ComboBox::from_label("presentation").selected_text(name(self.present_mode)).show_ui(ui, |ui| {
            for mode in modes {
                ui.selectable_value(&mut self.present_mode, *mode, name(*mode));
            }
        });
    }
}

fn show_times(ui: &mut Ui, profile: &GpuProfile) {
    Grid::new("times").striped(true).num_columns(2).show(ui, |ui| {
        for Row { depth, name, ms } in rows(profile) {
            ui.label(format!("{:indent$}{name}", "", indent = 3 * depth));
            ui.monospace(format!("{ms:9.3} ms"));
            ui.end_row();
        }
    });
}

fn show_keys(ui: &mut Ui, keys: &[(&str, &str)]) {
    Grid::new("keys").num_columns(2).show(ui, |ui| {
        for (key, meaning) in keys {
            ui.monospace(*key);
            ui.label(*meaning);
            ui.end_row();
        }
    });
}

/// The frame and its scopes, those with the same name in the same place together.
fn rows(profile: &GpuProfile) -> Vec<Row> {
    let mut rows = vec![Row { depth: 0, name: "frame".to_owned(), ms: profile.ms }];
    add_rows(&mut rows, &profile.scopes.iter().collect::<Vec<_>>(), 1);
    rows
}

fn add_rows(rows: &mut Vec<Row>, scopes: &[&GpuScope], depth: usize) {
    let mut names: Vec<&str> = Vec::new();
    for scope in scopes {
        if names.contains(&scope.name.as_str()) {
            continue;
        }
        names.push(&scope.name);
        let alike: Vec<&GpuScope> = scopes.iter().copied().filter(|other| other.name == scope.name).collect();
        rows.push(Row { depth, name: scope.name.clone(), ms: alike.iter().map(|scope| scope.ms).sum() });
        add_rows(rows, &alike.iter().flat_map(|scope| &scope.children).collect::<Vec<_>>(), depth + 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scope(name: &str, ms: f64, children: Vec<GpuScope>) -> GpuScope {
        GpuScope { name: name.to_owned(), start_ms: 0.0, ms, children }
    }

    #[test]
    fn scopes_with_one_name_are_one_line() {
        let scopes = vec![
            scope("draw", 1.0, vec![scope("depth", 0.5, Vec::new())]),
            scope("rays", 2.0, Vec::new()),
            scope("draw", 3.0, vec![scope("depth", 1.5, Vec::new()), scope("blend", 1.0, Vec::new())]),
        ];
        let rows = rows(&GpuProfile { ms: 7.0, scopes, ..GpuProfile::default() });
        let found: Vec<_> = rows.iter().map(|row| (row.depth, row.name.as_str(), row.ms)).collect();
        let expected =
            [(0, "frame", 7.0), (1, "draw", 4.0), (2, "depth", 2.0), (2, "blend", 1.0), (1, "rays", 2.0)];
        assert_eq!(found, expected);
    }

    #[test]
    fn the_time_of_frames_is_smoothed() {
        let mut panel = Panel::new(PresentMode::Fifo);
        panel.count_frame(0.010);
        assert!((panel.frame_ms - 10.0).abs() < 1e-3);
        panel.count_frame(0.030);
        assert!((panel.frame_ms - 11.0).abs() < 1e-3);
    }
}
