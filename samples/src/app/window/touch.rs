//! Touches as events of a mouse, for screens without one.

use winit::event::{ElementState, MouseButton, Touch, TouchPhase, WindowEvent};

/// The finger that acts as the mouse: the first one on the screen. Others are ignored.
#[derive(Debug, Default)]
pub(super) struct Finger {
    held: Option<u64>,
}

impl Finger {
    /// Returns the events of a mouse that a touch stands for.
    pub(super) fn as_mouse(&mut self, touch: &Touch) -> Vec<WindowEvent> {
        let device_id = touch.device_id;
        let moved = WindowEvent::CursorMoved { device_id, position: touch.location };
        let button = |state| WindowEvent::MouseInput { device_id, state, button: MouseButton::Left };
        let is_held = self.held == Some(touch.id);
        match touch.phase {
            TouchPhase::Started if self.held.is_none() => {
                self.held = Some(touch.id);
                vec![moved, button(ElementState::Pressed)]
            }
            TouchPhase::Moved if is_held => vec![moved],
            TouchPhase::Ended | TouchPhase::Cancelled if is_held => {
                self.held = None;
                vec![moved, button(ElementState::Released), WindowEvent::CursorLeft { device_id }]
            }
            _ => Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use winit::dpi::PhysicalPosition;
    use winit::event::DeviceId;

    use super::*;

    fn touch(id: u64, phase: TouchPhase) -> Touch {
        let location = PhysicalPosition::new(id as f64, 2.0);
        Touch { device_id: DeviceId::dummy(), phase, location, force: None, id }
    }

    #[test]
    fn the_first_finger_drags_and_others_do_not() {
        let mut finger = Finger::default();
        let mut events = |id, phase| finger.as_mouse(&touch(id, phase)).len();
        assert_eq!(events(7, TouchPhase::Moved), 0, "it is not on the screen");
        assert_eq!(events(7, TouchPhase::Started), 2);
        assert_eq!([events(8, TouchPhase::Started), events(8, TouchPhase::Moved)], [0, 0]);
        assert_eq!(events(7, TouchPhase::Moved), 1);
        assert_eq!(events(8, TouchPhase::Ended), 0);
        assert_eq!(events(7, TouchPhase::Cancelled), 3);
        assert_eq!(events(8, TouchPhase::Started), 2, "now it is the first");
        let released = finger.as_mouse(&touch(8, TouchPhase::Ended));
        assert!(matches!(released[0], WindowEvent::CursorMoved { position, .. } if position.x == 8.0));
        assert!(matches!(released[1], WindowEvent::MouseInput { state: ElementState::Released, .. }));
        assert!(matches!(released[2], WindowEvent::CursorLeft { .. }));
    }
}
