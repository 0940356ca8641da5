//! A sample in a window: camera by mouse and keys, a panel with switches and times, shaders compiled as they change.

mod clock;
mod controls;
mod pilot;
mod program;
mod resize;
mod screen;
mod ui_input;

pub(super) use program::run;
