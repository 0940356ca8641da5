//! Settings in the panel of the window.

use egui::{Slider, Ui};
use lvk::Capabilities;

use super::config::{Bounces, Geometry, HybridConfig, Method, RayPath};
use crate::app::ui::option_button;

/// Most samples that the slider offers: they are rendered one after the other, while a person waits.
const MOST_SAMPLES: u32 = 16;

/// Lays out the switches of `config`. Without `goes_on` nothing in the scene mirrors or refracts.
pub(super) fn show_settings(
    ui: &mut Ui,
    config: &mut HybridConfig,
    capabilities: &Capabilities,
    goes_on: bool,
) {
    show_method(ui, config, capabilities);
    let before = *config;
    path_switch(ui, &mut config.path, |path| can_be(&HybridConfig { path, ..before }, capabilities));
    if goes_on {
        show_bounces(ui, config, capabilities);
        ui.add(Slider::new(&mut config.max_depth, 0..=HybridConfig::MAX_DEPTH).text("mirrored or bent"));
    } else {
        ui.label("nothing mirrors or bends light");
    }
    let most = MOST_SAMPLES.max(config.samples);
    ui.add(Slider::new(&mut config.samples, 1..=most).text("samples a pixel"));
}

/// Lays out the ways of tracing rays, those that `can_be` to choose from.
pub(crate) fn path_switch(ui: &mut Ui, path: &mut RayPath, can_be: impl Fn(RayPath) -> bool) {
    ui.horizontal(|ui| {
        ui.label("rays");
        option_button(ui, path, "by pipeline", |_| RayPath::Pipeline, |path| can_be(*path));
        option_button(ui, path, "by query", |_| RayPath::Query, |path| can_be(*path));
    });
}

fn show_method(ui: &mut Ui, config: &mut HybridConfig, capabilities: &Capabilities) {
    let can_be = |config: &HybridConfig| can_be(config, capabilities);
    ui.horizontal(|ui| {
        ui.label("seen");
        let by = |method| move |config| corrected(HybridConfig { method, ..config });
        option_button(ui, config, "by rays", by(Method::Standalone), can_be);
        option_button(ui, config, "by rasteriser", by(Method::Hybrid), can_be);
    });
    if config.method == Method::Standalone {
        return;
    }
    let triangles = match config.geometry {
        Geometry::Visibility(_) => config.geometry,
        Geometry::Paper => Geometry::default(),
    };
    ui.horizontal(|ui| {
        ui.label("G-buffer");
        option_button(
            ui,
            config,
            "triangles",
            |config| HybridConfig { geometry: triangles, ..config },
            can_be,
        );
        let of_paper = |config| corrected(HybridConfig { geometry: Geometry::Paper, ..config });
        option_button(ui, config, "the paper's", of_paper, can_be);
    });
}

fn show_bounces(ui: &mut Ui, config: &mut HybridConfig, capabilities: &Capabilities) {
    let can_be = |config: &HybridConfig| can_be(config, capabilities);
    ui.horizontal(|ui| {
        ui.label("bounces");
        for (text, bounces) in
            [("inline", Bounces::Inline), ("queued", Bounces::Queued), ("first", Bounces::First)]
        {
            option_button(
                ui,
                config,
                text,
                |config| HybridConfig { bounces: Some(bounces), ..config },
                can_be,
            );
        }
    });
}

/// True if the device can render by `config`.
fn can_be(config: &HybridConfig, capabilities: &Capabilities) -> bool {
    let can_queue = config.path == RayPath::Query || capabilities.trace_rays_indirect;
    config.check(capabilities).is_ok() && (can_queue || config.bounces != Some(Bounces::Queued))
}

/// The configuration with bounces that its method has.
fn corrected(config: HybridConfig) -> HybridConfig {
    let is_lost = config.bounces == Some(Bounces::First) && !config.knows_triangles();
    HybridConfig { bounces: if is_lost { Some(Bounces::Inline) } else { config.bounces }, ..config }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounces_that_a_method_lacks_become_inline() {
        let first = HybridConfig { bounces: Some(Bounces::First), ..HybridConfig::default() };
        assert_eq!(corrected(first), first);
        for unsupported in [
            HybridConfig { method: Method::Standalone, ..first },
            HybridConfig { geometry: Geometry::Paper, ..first },
        ] {
            assert_eq!(
                corrected(unsupported),
                HybridConfig { bounces: Some(Bounces::Inline), ..unsupported }
            );
            let queued = HybridConfig { bounces: Some(Bounces::Queued), ..unsupported };
            assert_eq!(corrected(queued), queued);
        }
    }
}
