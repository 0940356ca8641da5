//! Translates events of a window for egui.

use egui::{Event, Key, Modifiers, MouseWheelUnit, PointerButton, Pos2, Vec2, pos2, vec2};
use winit::dpi::PhysicalPosition;
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::keyboard::{KeyCode, ModifiersState, PhysicalKey};

/// Gathers events until egui asks for them.
#[derive(Debug, Default)]
pub(super) struct UiInput {
    events: Vec<Event>,
    modifiers: Modifiers,
    pointer: Pos2,
}

impl UiInput {
    /// Takes note of an event in a window with `per_point` pixels a point.
    pub(super) fn push(&mut self, event: &WindowEvent, per_point: f32) {
        match event {
            WindowEvent::ModifiersChanged(modifiers) => self.modifiers = ui_modifiers(modifiers.state()),
            WindowEvent::CursorMoved { position, .. } => {
                self.pointer = in_points(*position, per_point);
                self.events.push(Event::PointerMoved(self.pointer));
            }
            WindowEvent::CursorLeft { .. } => self.events.push(Event::PointerGone),
            WindowEvent::MouseInput { state, button, .. } => {
                if let Some(button) = ui_button(*button) {
                    let (pos, modifiers, pressed) = (self.pointer, self.modifiers, state.is_pressed());
                    self.events.push(Event::PointerButton { pos, button, pressed, modifiers });
                }
            }
            WindowEvent::MouseWheel { delta, .. } => {
                let (unit, delta) = wheel(*delta, per_point);
                self.events.push(Event::MouseWheel { unit, delta, modifiers: self.modifiers });
            }
            WindowEvent::KeyboardInput { event, is_synthetic: false, .. } => {
                let PhysicalKey::Code(code) = event.physical_key else { return };
                self.key(code, event.state, event.repeat, event.text.as_deref());
            }
            WindowEvent::Focused(focused) => self.events.push(Event::WindowFocused(*focused)),
            _ => {}
        }
    }

    /// The pointer in points.
    pub(super) fn pointer(&self) -> Pos2 {
        self.pointer
    }

    /// Takes the events since the last call, and the modifier keys.
    pub(super) fn take_events(&mut self) -> (Vec<Event>, Modifiers) {
        (std::mem::take(&mut self.events), self.modifiers)
    }

    fn key(&mut self, code: KeyCode, state: ElementState, repeat: bool, text: Option<&str>) {
        let (pressed, modifiers) = (state.is_pressed(), self.modifiers);
        if let Some(key) = ui_key(code) {
            self.events.push(Event::Key { key, physical_key: None, pressed, repeat, modifiers });
        }
        let typed = text.filter(|text| pressed && !modifiers.command && !text.chars().any(char::is_control));
        self.events.extend(typed.map(|text| Event::Text(text.to_owned())));
    }
}

fn in_points(place: PhysicalPosition<f64>, per_point: f32) -> Pos2 {
    pos2(place.x as f32 / per_point, place.y as f32 / per_point)
}

/// The distance of a turn of the wheel.
fn wheel(delta: MouseScrollDelta, per_point: f32) -> (MouseWheelUnit, Vec2) {
    match delta {
        MouseScrollDelta::LineDelta(x, y) => (MouseWheelUnit::Line, vec2(x, y)),
        MouseScrollDelta::PixelDelta(place) => (MouseWheelUnit::Point, in_points(place, per_point).to_vec2()),
    }
}

/// Notches that the wheel was turned away.
pub(super) fn notches(delta: MouseScrollDelta) -> f32 {
    const PIXELS: f64 = 50.0;
    match delta {
        MouseScrollDelta::LineDelta(_, y) => y,
        MouseScrollDelta::PixelDelta(place) => (place.y / PIXELS) as f32,
    }
}

fn ui_modifiers(state: ModifiersState) -> Modifiers {
    let command = state.control_key();
    let (alt, shift) = (state.alt_key(), state.shift_key());
    Modifiers { alt, ctrl: command, shift, mac_cmd: false, command }
}

fn ui_button(button: MouseButton) -> Option<PointerButton> {
    match button {
        MouseButton::Left => Some(PointerButton::Primary),
        MouseButton::Right => Some(PointerButton::Secondary),
        MouseButton::Middle => Some(PointerButton::Middle),
        _ => None,
    }
}

/// The keys by which a text or a number is edited.
fn ui_key(code: KeyCode) -> Option<Key> {
    Some(match code {
        KeyCode::ArrowDown => Key::ArrowDown,
        KeyCode::ArrowLeft => Key::ArrowLeft,
        KeyCode::ArrowRight => Key::ArrowRight,
        KeyCode::ArrowUp => Key::ArrowUp,
        KeyCode::Backspace => Key::Backspace,
        KeyCode::Delete => Key::Delete,
        KeyCode::End => Key::End,
        KeyCode::Enter | KeyCode::NumpadEnter => Key::Enter,
        KeyCode::Escape => Key::Escape,
        KeyCode::Home => Key::Home,
        KeyCode::KeyA => Key::A,
        KeyCode::Tab => Key::Tab,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use winit::event::DeviceId;

    use super::*;

    #[test]
    fn places_are_in_points_and_buttons_are_where_the_mouse_is() {
        let mut input = UiInput::default();
        let device_id = DeviceId::dummy();
        input.push(&WindowEvent::CursorMoved { device_id, position: PhysicalPosition::new(30.0, 50.0) }, 2.0);
        let (state, button) = (ElementState::Pressed, MouseButton::Left);
        input.push(&WindowEvent::MouseInput { device_id, state, button }, 2.0);
        let (events, _) = input.take_events();
        assert_eq!(events[0], Event::PointerMoved(pos2(15.0, 25.0)));
        assert!(
            matches!(events[1], Event::PointerButton { pos, pressed: true, .. } if pos == pos2(15.0, 25.0))
        );
        assert!(input.take_events().0.is_empty());
    }

    #[test]
    fn keys_edit_and_letters_are_typed() {
        let mut input = UiInput::default();
        input.key(KeyCode::Digit4, ElementState::Pressed, false, Some("4"));
        input.key(KeyCode::Backspace, ElementState::Pressed, true, Some("\u{8}"));
        input.key(KeyCode::Digit4, ElementState::Released, false, Some("4"));
        let (events, _) = input.take_events();
        assert_eq!(events[0], Event::Text("4".to_owned()));
        assert!(matches!(events[1], Event::Key { key: Key::Backspace, repeat: true, .. }));
        assert_eq!(events.len(), 2);
    }

    #[test]
    fn wheels_count_in_notches() {
        assert_eq!(notches(MouseScrollDelta::LineDelta(0.0, -2.0)), -2.0);
        assert_eq!(notches(MouseScrollDelta::PixelDelta(PhysicalPosition::new(0.0, 100.0))), 2.0);
    }
}
