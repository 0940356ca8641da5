//! Reads camera files; [`SceneError::CameraFile`] documents the format.

use std::path::Path;

use glam::Vec3;

use super::{Camera, SceneError};
use crate::app::input_file::{self, FileKind};

/// Light and cameras of one scene.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Views {
    /// The scene's name in the file.
    pub name: String,
    /// Position of the point light.
    pub light: [f32; 3],
    /// Unit vector towards the sun, if it shines.
    pub sun: Option<[f32; 3]>,
    /// Up to five cameras.
    pub cameras: Vec<Camera>,
}

impl Views {
    /// Moves the light and the cameras, in scene units. The sun is everywhere.
    pub(super) fn move_by(&mut self, offset: [f64; 3]) {
        let eyes = self.cameras.iter_mut().flat_map(|camera| [&mut camera.eye, &mut camera.target]);
        for point in eyes.chain([&mut self.light]) {
            *point = std::array::from_fn(|i| (f64::from(point[i]) + offset[i]) as f32);
        }
    }
}

/// Reads the views of the scene called `name`; in a file with a single scene any name will do.
pub(super) fn read(path: &Path, name: &str) -> Result<Views, SceneError> {
    let unreadable = |source| SceneError::from_io(path, source);
    let bytes = input_file::read_named_by_user(path, FileKind::Cameras).map_err(unreadable)?;
    let text = String::from_utf8(bytes).map_err(|_| wrong(path, 0, "it is not text in UTF-8".to_owned()))?;
    let mut all = parse(path, &text)?;
    let found = match all.iter().position(|views| views.name == name) {
        Some(i) => all.swap_remove(i),
        None if all.len() == 1 => all.remove(0),
        None => return Err(wrong(path, 0, format!("none of its {} scenes is called `{name}`", all.len()))),
    };
    match found.cameras.is_empty() {
        true => Err(wrong(path, 0, format!("scene `{}` has no camera", found.name))),
        false => Ok(found),
    }
}

/// Parses the text of a camera file; `path` is for error messages.
pub(super) fn parse(path: &Path, text: &str) -> Result<Vec<Views>, SceneError> {
    let mut all: Vec<Views> = Vec::new();
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    for (line, number) in text.lines().zip(1..) {
        let mut words = line.split('#').next().unwrap_or("").split_whitespace();
        let Some(keyword) = words.next() else { continue };
        match keyword {
            "scene" => {
                let name = words.next().ok_or_else(|| wrong(path, number, "no scene name".to_owned()))?;
                let light = numbers(words).map_err(|what| wrong(path, number, what))?;
                all.push(Views { name: name.to_owned(), light, sun: None, cameras: Vec::new() });
            }
            "sun" => {
                let direction = sun(words).map_err(|what| wrong(path, number, what))?;
                let views =
                    all.last_mut().ok_or_else(|| wrong(path, number, "a sun before any scene".into()))?;
                if views.sun.replace(direction).is_some() {
                    return Err(wrong(path, number, "a second sun in a scene".to_owned()));
                }
            }
            "at" | "dir" => {
                let camera = camera(keyword == "dir", words).map_err(|what| wrong(path, number, what))?;
                let views =
                    all.last_mut().ok_or_else(|| wrong(path, number, "a camera before any scene".into()))?;
                if views.cameras.len() == 5 {
                    return Err(wrong(path, number, "more than five cameras in a scene".to_owned()));
                }
                views.cameras.push(camera);
            }
            _ => return Err(wrong(path, number, format!("`{keyword}` is unknown"))),
        }
    }
    Ok(all)
}

fn sun<'a>(words: impl Iterator<Item = &'a str>) -> Result<[f32; 3], String> {
    let direction = Vec3::from(numbers::<3>(words)?).try_normalize();
    direction
        .map(|towards| towards.to_array())
        .ok_or_else(|| "the sun stands nowhere: its direction has no length".to_owned())
}

fn camera<'a>(is_direction: bool, words: impl Iterator<Item = &'a str>) -> Result<Camera, String> {
    let [ex, ey, ez, x, y, z, fov] = numbers(words)?;
    if !(fov > 0.0 && fov < 180.0) {
        return Err(format!("the field of view {fov} is not between 0 and 180 degrees"));
    }
    let camera = match is_direction {
        true => Camera::looking_along([ex, ey, ez], [x, y, z], fov),
        false => Camera::looking_at([ex, ey, ez], [x, y, z], fov),
    };
    match camera.eye == camera.target {
        true => Err("the camera looks nowhere: eye and target are the same".to_owned()),
        false => Ok(camera),
    }
}

/// Exactly `N` finite numbers.
fn numbers<'a, const N: usize>(words: impl Iterator<Item = &'a str>) -> Result<[f32; N], String> {
    let parsed: Result<Vec<f32>, String> = words
        .map(|word| match word.parse::<f32>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(format!("`{word}` is not a finite number")),
        })
        .collect();
    parsed?.try_into().map_err(|found: Vec<f32>| format!("{N} numbers needed, found {}", found.len()))
}

fn wrong(path: &Path, line: usize, what: String) -> SceneError {
    SceneError::CameraFile { path: path.into(), line, what }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_byte_order_mark_is_skipped() {
        let all = parse(Path::new("a"), "\u{feff}scene a 1 2 3\n").unwrap();
        assert_eq!((all[0].name.as_str(), all[0].light), ("a", [1.0, 2.0, 3.0]));
    }

    fn parsed(text: &str) -> Result<Vec<Views>, SceneError> {
        parse(Path::new("c.txt"), text)
    }

    #[test]
    fn both_kinds_of_camera_are_read() {
        let all =
            parsed("# mine\nscene a 1 2 3\nat 0 0 0 0 0 -2 60 # front\n\ndir 1 1 1 0 0 -2 75\n").unwrap();
        let cameras = [
            Camera::looking_at([0.0; 3], [0.0, 0.0, -2.0], 60.0),
            Camera::looking_at([1.0; 3], [1.0, 1.0, -1.0], 75.0),
        ];
        assert_eq!(
            all,
            [Views { name: "a".to_owned(), light: [1.0, 2.0, 3.0], sun: None, cameras: cameras.into() }]
        );
    }

    #[test]
    fn the_sun_is_a_unit_vector_and_stays_where_it_is() {
        let all = parsed("scene a 1 2 3\nsun 0 3 4\nscene b 1 2 3\n").unwrap();
        assert_eq!((all[0].sun, all[1].sun), (Some([0.0, 0.6, 0.8]), None));
        let mut views = all[0].clone();
        views.move_by([1.0; 3]);
        assert_eq!((views.light, views.sun), ([2.0, 3.0, 4.0], all[0].sun));
    }

    #[test]
    fn mistakes_are_named_with_their_line() {
        for (text, line) in [
            ("at 0 0 0 0 0 1 60", 1),
            ("scene a 1 2", 1),
            ("scene", 1),
            ("scene a 1 2 3\nat 0 0 0 0 0 1", 2),
            ("scene a 1 2 3\nat 0 0 0 0 0 0 60", 2),
            ("scene a 1 2 3\nat 0 0 0 0 0 1 180", 2),
            ("scene a 1 2 3\n\ndir 0 0 0 nan 0 1 60", 3),
            ("light 1 2 3", 1),
            ("sun 1 2 3", 1),
            ("scene a 1 2 3\nsun 0 0 0", 2),
            ("scene a 1 2 3\nsun 1 2", 2),
            ("scene a 1 2 3\nsun 1 2 3\nsun 1 2 3", 3),
        ] {
            match parsed(text) {
                Err(SceneError::CameraFile { line: found, .. }) => assert_eq!(found, line, "{text}"),
                other => panic!("{text}: {other:?}"),
            }
        }
        let six = format!("scene a 1 2 3\n{}", "at 0 0 0 0 0 1 60\n".repeat(6));
        assert!(matches!(parsed(&six), Err(SceneError::CameraFile { line: 7, .. })));
    }

    #[test]
    fn the_scene_is_chosen_by_name_or_because_it_is_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("c.txt");
        std::fs::write(&path, "scene a 1 2 3\nat 0 0 0 0 0 1 60\n").unwrap();
        assert_eq!(read(&path, "b").unwrap().name, "a");
        std::fs::write(&path, "scene a 1 2 3\nat 0 0 0 0 0 1 60\nscene b 1 2 3\n").unwrap();
        assert_eq!(read(&path, "a").unwrap().name, "a");
        assert!(read(&path, "b").is_err(), "no cameras");
        assert!(read(&path, "c").is_err(), "no such scene");
        assert!(matches!(read(&folder.path().join("x"), "a"), Err(SceneError::NotFound { .. })));
    }
}
