//! Settings of a panel that need new pipelines or targets, applied between two frames.

use std::fmt::Display;

#[cfg(feature = "window")]
use egui::{Color32, RichText, Ui};

/// A configuration that a panel edits and a sample takes over between two frames.
#[derive(Debug, Clone, PartialEq)]
pub struct PendingSettings<C> {
    /// The configuration that the panel asks for.
    pub config: C,
    /// True if a slider is under way, so that it may be something else in a moment.
    is_held: bool,
    /// Error of the last change, if it failed.
    refused: Option<String>,
}

impl<C: Copy + PartialEq> PendingSettings<C> {
    /// Starts from the current configuration.
    #[must_use]
    pub fn new(config: C) -> Self {
        Self { config, is_held: false, refused: None }
    }

    /// Lays out `switches` of it, and why the last wish was refused, if it was.
    #[cfg(feature = "window")]
    pub fn show(&mut self, ui: &mut Ui, switches: impl FnOnce(&mut Ui, &mut C)) {
        switches(ui, &mut self.config);
        self.is_held = ui.input(|input| input.pointer.any_down());
        if let Some(refused) = &self.refused {
            ui.label(RichText::new(refused).color(Color32::LIGHT_RED));
        }
    }

    /// The configuration to apply, if it differs from `current` and no slider is being dragged.
    #[must_use]
    pub fn changed_from(&self, current: C) -> Option<C> {
        (!self.is_held && self.config != current).then_some(self.config)
    }

    /// Ends a change: keeps the error for the panel, and resets the settings to `current`.
    pub fn finish<E: Display>(&mut self, done: Result<(), E>, current: C) {
        self.refused = done.err().map(|error| error.to_string());
        self.config = current;
    }
}

/// A button for one of several values. It can be pressed where `can_be` holds of the configuration that `set` makes.
#[cfg(feature = "window")]
pub(crate) fn option_button<C: Copy + PartialEq>(
    ui: &mut Ui,
    config: &mut C,
    text: &str,
    set: impl FnOnce(C) -> C,
    can_be: impl FnOnce(&C) -> bool,
) {
    let candidate = set(*config);
    let button = egui::Button::selectable(candidate == *config, text);
    if ui.add_enabled(can_be(&candidate), button).clicked() {
        *config = candidate;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn new_settings_apply_once_and_refused_ones_are_dropped() {
        let mut wanted = PendingSettings::new(3);
        assert_eq!(wanted.changed_from(3), None);
        wanted.config = 99;
        assert_eq!(wanted.changed_from(3), Some(99));
        wanted.finish(Err("99 is too much"), 3);
        assert_eq!((wanted.changed_from(3), wanted.refused.as_deref()), (None, Some("99 is too much")));
        wanted.config = 5;
        assert_eq!(wanted.changed_from(3), Some(5));
        wanted.finish(Ok::<_, String>(()), 5);
        assert_eq!((wanted.changed_from(5), &wanted.refused), (None, &None));
    }

    #[test]
    fn a_slider_under_way_is_waited_for() {
        let mut wanted = PendingSettings { is_held: true, ..PendingSettings::new(1) };
        wanted.config = 2;
        assert_eq!(wanted.changed_from(1), None);
        wanted.is_held = false;
        assert_eq!(wanted.changed_from(1), Some(2));
    }
}
