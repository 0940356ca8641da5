//! The mapping of keys and mouse to actions of a window.

use std::collections::HashSet;

use winit::keyboard::KeyCode;

use crate::app::fly_camera::Steering;

/// Radians for each pixel that the mouse is dragged.
const TURN: f32 = 0.004;

/// The action of a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Action {
    /// Lets the animation stand or go on.
    Pause,
    /// Gives the camera back to the animation.
    ReleaseCamera,
    /// Goes around what the camera looks at, or flies again.
    Orbit,
    /// Shows or hides the panel.
    Panel,
    /// Goes on to the next of what the sample shows.
    Next,
    /// Compiles all shaders again.
    Reload,
    /// Goes on in another window, as after a pause on Android.
    Reopen,
    /// Saves what the window shows.
    Screenshot,
    /// Closes the window.
    Close,
}

/// The keys, as the panel tells them; those of the camera first.
const HELP: [(&str, &str); 11] = [
    ("drag", "look around, or orbit"),
    ("W A S D", "fly"),
    ("Q E", "down, up"),
    ("Shift, wheel", "in a hurry; faster, or nearer"),
    ("O", "orbit or fly"),
    ("C", "the animation's camera"),
    ("Space", "animation"),
    ("F1", "this panel"),
    ("F5", "shaders anew"),
    ("F9", "another window"),
    ("F12, Esc", "screenshot, close"),
];

/// Number of keys of the camera.
const CAMERA_KEYS: usize = 6;

/// Returns the help for keys and mouse, of a sample with or without a camera.
pub(super) fn help(has_camera: bool) -> &'static [(&'static str, &'static str)] {
    &HELP[if has_camera { 0 } else { CAMERA_KEYS }..]
}

/// Keys that are held and how far the mouse was moved: what steers the camera.
#[derive(Debug, Default)]
pub(super) struct Controls {
    held: HashSet<KeyCode>,
    /// Pressed since the last time, though perhaps let go already.
    tapped: HashSet<KeyCode>,
    is_dragging: bool,
    pointer: Option<[f32; 2]>,
    turn: [f32; 2],
    faster: f32,
}

impl Controls {
    /// A key goes down or up. Answers what it asks for, once for each time that it goes down.
    pub(super) fn key(&mut self, key: KeyCode, is_down: bool) -> Option<Action> {
        if !is_down {
            self.held.remove(&key);
            return None;
        }
        if !self.held.insert(key) {
            return None;
        }
        self.tapped.insert(key);
        match key {
            KeyCode::Space => Some(Action::Pause),
            KeyCode::KeyC => Some(Action::ReleaseCamera),
            KeyCode::KeyO => Some(Action::Orbit),
            KeyCode::F1 => Some(Action::Panel),
            KeyCode::KeyN => Some(Action::Next),
            KeyCode::F5 => Some(Action::Reload),
            KeyCode::F9 => Some(Action::Reopen),
            KeyCode::F12 => Some(Action::Screenshot),
            KeyCode::Escape => Some(Action::Close),
            _ => None,
        }
    }

    /// The mouse is pressed on the picture, or let go anywhere.
    pub(super) fn drag(&mut self, is_down: bool) {
        self.is_dragging = is_down;
    }

    /// The mouse is here, in pixels.
    pub(super) fn pointer(&mut self, place: [f32; 2]) {
        if let (true, Some(before)) = (self.is_dragging, self.pointer) {
            self.turn = [0, 1].map(|axis| self.turn[axis] + TURN * (place[axis] - before[axis]));
        }
        self.pointer = Some(place);
    }

    /// The wheel was turned so many notches away.
    pub(super) fn wheel(&mut self, notches: f32) {
        self.faster += notches;
    }

    /// Releases all keys, as when the window loses the focus.
    pub(super) fn release_all(&mut self) {
        *self = Self { pointer: self.pointer, ..Self::default() };
    }

    /// Takes the steering since the last call.
    pub(super) fn take_steering(&mut self) -> Steering {
        let is_on = |key| self.held.contains(&key) || self.tapped.contains(&key);
        let axis = |plus, minus| f32::from(is_on(plus)) - f32::from(is_on(minus));
        let steering = Steering {
            direction: [
                axis(KeyCode::KeyD, KeyCode::KeyA),
                axis(KeyCode::KeyE, KeyCode::KeyQ),
                axis(KeyCode::KeyW, KeyCode::KeyS),
            ],
            turn: self.turn,
            faster: self.faster,
            hurry: is_on(KeyCode::ShiftLeft) || is_on(KeyCode::ShiftRight),
        };
        self.tapped.clear();
        (self.turn, self.faster) = ([0.0; 2], 0.0);
        steering
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn held_keys_steer_until_they_are_let_go() {
        let mut controls = Controls::default();
        for key in [KeyCode::KeyW, KeyCode::KeyQ, KeyCode::ShiftLeft] {
            assert_eq!(controls.key(key, true), None);
        }
        for _ in 0..2 {
            let steering = controls.take_steering();
            assert_eq!((steering.direction, steering.hurry), ([0.0, -1.0, 1.0], true));
        }
        controls.key(KeyCode::KeyS, true);
        controls.key(KeyCode::KeyQ, false);
        assert_eq!(controls.take_steering().direction, [0.0; 3], "forward and back");
        controls.release_all();
        assert_eq!(controls.take_steering(), Steering::default());
    }

    #[test]
    fn a_tap_between_two_frames_is_felt_once() {
        let mut controls = Controls::default();
        controls.key(KeyCode::KeyA, true);
        controls.key(KeyCode::KeyA, false);
        assert_eq!(controls.take_steering().direction, [-1.0, 0.0, 0.0]);
        assert_eq!(controls.take_steering().direction, [0.0; 3]);
    }

    #[test]
    fn actions_come_once_for_each_press() {
        let mut controls = Controls::default();
        assert_eq!(controls.key(KeyCode::F12, true), Some(Action::Screenshot));
        assert_eq!(controls.key(KeyCode::F12, true), None, "repeated while it is held");
        assert_eq!(controls.key(KeyCode::F12, false), None);
        assert_eq!(controls.key(KeyCode::F12, true), Some(Action::Screenshot));
    }

    #[test]
    fn the_help_names_no_camera_keys_without_a_camera() {
        let keys = |has_camera| help(has_camera).iter().map(|(key, _)| *key).collect::<Vec<_>>();
        assert_eq!(keys(true)[..CAMERA_KEYS], ["drag", "W A S D", "Q E", "Shift, wheel", "O", "C"]);
        assert_eq!(keys(false), ["Space", "F1", "F5", "F9", "F12, Esc"]);
    }

    #[test]
    fn the_mouse_turns_only_while_it_is_pressed() {
        let mut controls = Controls::default();
        controls.pointer([5.0, 5.0]);
        controls.pointer([9.0, 5.0]);
        assert_eq!(controls.take_steering(), Steering::default());
        controls.drag(true);
        controls.pointer([109.0, 55.0]);
        controls.wheel(2.0);
        let steering = controls.take_steering();
        assert!((steering.turn[0] - 0.4).abs() < 1e-6 && (steering.turn[1] - 0.2).abs() < 1e-6);
        assert_eq!((steering.faster, controls.take_steering()), (2.0, Steering::default()));
        controls.drag(false);
        controls.pointer([0.0, 0.0]);
        assert_eq!(controls.take_steering(), Steering::default());
    }
}
