//! A sample in a window: camera by mouse and keys, a panel with switches and times, shaders compiled as they change.

mod camera_controller;
mod clock;
mod controls;
mod present_pass;
mod resize;
mod touch;
mod ui_input;
mod window_app;

pub(super) use window_app::run;

use winit::event_loop::EventLoop;

/// The event loop of the window system, before it is built.
pub type EventLoopBuilder = winit::event_loop::EventLoopBuilder<()>;

/// Returns the event loop of the window system.
pub fn event_loop() -> EventLoopBuilder {
    EventLoop::builder()
}
