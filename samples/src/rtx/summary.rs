//! What a sample's program says before it renders.

use std::fmt::Write as _;

use lvk::Capabilities;

use crate::app::device::{device_text, query_text};
use crate::hybrid::RayPath;

/// The device, how rays are traced on it - by queries in `stages`, where by those -, and what the picture shows.
pub(crate) fn summary(capabilities: &Capabilities, path: RayPath, stages: &str, scene: &str) -> String {
    let mut text = device_text(capabilities);
    let path = match path {
        RayPath::Pipeline => "ray tracing pipeline",
        RayPath::Query => &query_text(capabilities, stages),
    };
    let _ = write!(text, "method    {path}\nscene     {scene}");
    text
}
