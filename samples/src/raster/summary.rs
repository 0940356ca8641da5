//! What a sample's program says before it renders.

use lvk::Capabilities;

use crate::app::device::device_text;

/// The device, and what the picture shows.
#[must_use]
pub fn summary(capabilities: &Capabilities, scene: &str) -> String {
    format!("{}scene     {scene}", device_text(capabilities))
}
