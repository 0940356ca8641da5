//! Scale, light and cameras of the three scenes that the benchmarks use.

use std::path::Path;

use super::camera_file::{self, Views};

/// Looked-at views, in scene units, in the format of camera files.
const VIEWS: &str = "
scene living_room 0.3 2.4 4.0
dir 2.25009 1.31171 6.17872 -0.434176 -0.0366305 -0.900083 90
at -1.8 1.6 6.0 1.5 0.8 1.5 75
at 0.3 1.5 1.6 0.3 0.8 6 75
at -1.5 2.6 2.0 1 0.3 4.5 80
at 0.9 0.9 4.4 0.3 0.4 3.0 60
scene conference 1 1.8 -0.6
at 4.4 1.5 1.3 0.5 0.5 -0.8 75
at -0.2 1.5 -2.6 3.5 0.5 0.2 75
at 4.3 1.25 -0.6 -2.5 0.5 -0.9 70
at 4.5 1.7 -2.6 0 0.4 0.3 75
at 2.0 0.9 0.8 3 0.5 -1.0 60
scene kitchen 0.3 2.6 1.0
dir 1.211 1.80475 3.85239 -0.4381 -0.0416703 -0.89796 60
at -1.5 1.7 3.5 1 1 -1 70
at 0.5 1.6 -1.5 -0.8 1.0 3.0 75
at 1.8 2.4 0.5 -1.5 0.9 0 70
at 0.3 1.4 1.6 -0.3 0.9 0.2 60
";

/// Factor from file units to metres of the benchmark scene called `name` (its file's stem).
pub(super) fn scale(name: &str) -> Option<f32> {
    match name {
        "conference" => Some(0.003),
        _ => views(name).map(|_| 1.0),
    }
}

/// Light and cameras of the benchmark scene called `name` (its file's stem).
pub(super) fn views(name: &str) -> Option<Views> {
    camera_file::parse(Path::new("built-in"), VIEWS).ok()?.into_iter().find(|views| views.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_three_scenes_have_five_cameras_each() {
        for name in ["living_room", "conference", "kitchen"] {
            assert_eq!(views(name).unwrap().cameras.len(), 5, "{name}");
            assert!(scale(name).is_some());
        }
        assert!(views("bunny").is_none() && scale("bunny").is_none());
    }
}
