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

/// Triangles of the scenes' published files, and the factor from file units to metres.
const KNOWN: [(&str, usize, f32); 3] =
    [("living_room", 601_209, 1.0), ("conference", 331_179, 0.003), ("kitchen", 1_021_815, 1.0)];

/// Scale, light and cameras of a benchmark scene.
pub(super) struct BenchmarkScene {
    /// Factor from file units to metres.
    pub scale: f32,
    /// Light and cameras, in metres.
    pub views: Views,
}

/// The benchmark scene whose file has the stem `name` and about `triangle_count` triangles (5 % more or less:
/// exporters differ). Another file of that name is no benchmark scene.
pub(super) fn find(name: &str, triangle_count: usize) -> Option<BenchmarkScene> {
    let (_, _, scale) = KNOWN.into_iter().find(|&(known, count, _)| {
        known == name && triangle_count.abs_diff(count).saturating_mul(20) <= count
    })?;
    let path = Path::new("built-in");
    let mut all = camera_file::parse(path, VIEWS.as_bytes()).ok()?.into_iter();
    let views = all.find(|views| views.name == name.as_bytes())?;
    Some(BenchmarkScene { scale, views: views.placed(path, |point| point).ok()? })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_three_scenes_have_five_cameras_each() {
        for (name, count, scale) in KNOWN {
            let found = find(name, count).unwrap();
            assert_eq!((found.views.cameras.len(), found.scale), (5, scale), "{name}");
            assert!(find(name, count / 100 * 96).is_some() && find(name, count / 100 * 104).is_some());
        }
    }

    #[test]
    fn a_file_that_only_shares_the_name_is_no_benchmark_scene() {
        for (name, count, _) in KNOWN {
            assert!(find(name, 12).is_none() && find(name, 0).is_none() && find(name, usize::MAX).is_none());
            assert!(find(name, count / 100 * 94).is_none() && find(name, count / 100 * 106).is_none());
        }
        assert!(find("bunny", 331_179).is_none());
    }
}
