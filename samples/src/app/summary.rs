//! The first lines of a sample's log: device, method and scene.

use lvk::Capabilities;

use super::device::{device_text, pipeline_text, query_text};
use crate::hybrid::RayPath;

/// The device, and what a sample that only rasterises shows.
pub(crate) fn raster_summary(capabilities: &Capabilities, scene: &str) -> String {
    format!("{}scene     {scene}", device_text(capabilities))
}

/// The device, how rays are traced on it - in `stages`, where by queries -, and what the sample shows.
pub(crate) fn ray_summary(capabilities: &Capabilities, path: RayPath, stages: &str, scene: &str) -> String {
    let method = path_text(capabilities, path, stages);
    format!("{}method    {method}\nscene     {scene}", device_text(capabilities))
}

/// The part of Vulkan that traces rays; `stages` are those with queries.
pub(crate) fn path_text(capabilities: &Capabilities, path: RayPath, stages: &str) -> String {
    match path {
        RayPath::Pipeline => pipeline_text(capabilities),
        RayPath::Query => query_text(capabilities, stages),
    }
}
