//! Reads camera files; [`SceneError::CameraFile`] documents the format.

use std::path::Path;

use glam::DVec3;
use lvk::readable_bytes;

use super::text_lines::{decoded, lines};
use super::text_numbers::Number;
use super::{Camera, SceneError};
use crate::app::input_file::{self, FileKind};

/// Light and cameras of one scene.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Views {
    /// Position of the point light.
    pub light: [f32; 3],
    /// Unit vector towards the sun, if it shines.
    pub sun: Option<[f32; 3]>,
    /// Up to five cameras.
    pub cameras: Vec<Camera>,
}

/// Light and cameras of one scene as a file has them, before the mesh is placed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FileViews {
    /// The scene's name in the file.
    pub name: Vec<u8>,
    light: [f64; 3],
    sun: Option<[f32; 3]>,
    cameras: Vec<FileCamera>,
}

#[derive(Debug, Clone, PartialEq)]
struct FileCamera {
    eye: [f64; 3],
    aim: Aim,
    vertical_fov_degrees: f32,
}

#[derive(Debug, Clone, PartialEq)]
enum Aim {
    At([f64; 3]),
    Along([f64; 3]),
}

impl FileViews {
    /// The views with every point moved by `place`. The sun is everywhere, and directions stay.
    ///
    /// # Errors
    /// [`SceneError::CameraFile`] if a point is too far away for single precision.
    pub(super) fn placed(
        &self,
        path: &Path,
        place: impl Fn([f64; 3]) -> [f64; 3],
    ) -> Result<Views, SceneError> {
        let light = place(self.light).map(|x| x as f32);
        let cameras: Vec<Camera> = self.cameras.iter().map(|camera| camera.placed(&place)).collect();
        let is_near = |point: [f32; 3]| point.iter().all(|x| x.is_finite());
        match is_near(light) && cameras.iter().all(|camera| is_near(camera.eye) && is_near(camera.target)) {
            true => Ok(Views { light, sun: self.sun, cameras }),
            false => {
                let name = readable_bytes(&self.name);
                Err(wrong(path, 0, format!("a point of scene `{name}` is too far from the mesh")))
            }
        }
    }
}

impl FileCamera {
    fn placed(&self, place: impl Fn([f64; 3]) -> [f64; 3]) -> Camera {
        let eye = DVec3::from(place(self.eye));
        let (target, direction) = match self.aim {
            Aim::At(target) => (DVec3::from(place(target)), DVec3::from(place(target)) - eye),
            Aim::Along(direction) => (eye + DVec3::from(direction), DVec3::from(direction)),
        };
        // A target beside a distant eye is the same number in single precision; one as far away as the origin is not.
        let is_beside = (target - eye).length() < 1e-3 * eye.abs().max_element();
        let reach = eye.abs().max_element().max(1.0);
        let target = if is_beside { eye + reach * direction.normalize_or(DVec3::NEG_Z) } else { target };
        Camera::looking_at(eye.as_vec3().to_array(), target.as_vec3().to_array(), self.vertical_fov_degrees)
    }
}

/// Reads the views of the scene called `name`; in a file with a single scene any name will do.
pub(super) fn read(path: &Path, name: &[u8]) -> Result<FileViews, SceneError> {
    let unreadable = |source| SceneError::from_io(path, source);
    let text = input_file::read_named_by_user(path, FileKind::Cameras).map_err(unreadable)?;
    let mut all = parse(path, &text)?;
    let found = match all.iter().position(|views| views.name == name) {
        Some(i) => all.swap_remove(i),
        None if all.len() == 1 => all.remove(0),
        None => {
            return Err(wrong(
                path,
                0,
                format!("none of its {} scenes is called `{}`", all.len(), readable_bytes(name)),
            ));
        }
    };
    match found.cameras.is_empty() {
        true => Err(wrong(path, 0, format!("scene `{}` has no camera", readable_bytes(&found.name)))),
        false => Ok(found),
    }
}

/// Parses the content of a camera file; `path` is for error messages.
pub(super) fn parse(path: &Path, content: &[u8]) -> Result<Vec<FileViews>, SceneError> {
    let mut all: Vec<FileViews> = Vec::new();
    for (line, number) in lines(&decoded(content)).zip(1..) {
        statement(&mut all, line).map_err(|what| wrong(path, number, what))?;
    }
    Ok(all)
}

fn statement(all: &mut Vec<FileViews>, line: &[u8]) -> Result<(), String> {
    let line = line.split(|byte| *byte == b'#').next().unwrap_or_default();
    let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    let Some(keyword) = words.next() else { return Ok(()) };
    match keyword {
        b"scene" => {
            let name = words.next().ok_or("no scene name")?.to_vec();
            let light = numbers(words)?;
            all.push(FileViews { name, light, sun: None, cameras: Vec::new() });
        }
        b"sun" => {
            let direction = sun(words)?;
            let views = all.last_mut().ok_or("a sun before any scene")?;
            if views.sun.replace(direction).is_some() {
                return Err("a second sun in a scene".to_owned());
            }
        }
        b"at" | b"dir" => {
            let camera = camera(keyword == b"dir", words)?;
            let views = all.last_mut().ok_or("a camera before any scene")?;
            if views.cameras.len() == 5 {
                return Err("more than five cameras in a scene".to_owned());
            }
            views.cameras.push(camera);
        }
        _ => return Err(format!("`{}` is unknown", readable_bytes(keyword))),
    }
    Ok(())
}

fn sun<'a>(words: impl Iterator<Item = &'a [u8]>) -> Result<[f32; 3], String> {
    let direction = DVec3::from(numbers::<3>(words)?).try_normalize();
    direction
        .map(|towards| towards.as_vec3().to_array())
        .ok_or_else(|| "the sun stands nowhere: its direction has no length".to_owned())
}

fn camera<'a>(is_direction: bool, words: impl Iterator<Item = &'a [u8]>) -> Result<FileCamera, String> {
    let [ex, ey, ez, x, y, z, fov] = numbers(words)?;
    if !(fov > 0.0 && fov < 180.0) {
        return Err(format!("the field of view {fov} is not between 0 and 180 degrees"));
    }
    let (eye, end) = ([ex, ey, ez], [x, y, z]);
    if if is_direction { end == [0.0; 3] } else { eye == end } {
        return Err("the camera looks nowhere: eye and target are the same".to_owned());
    }
    let aim = if is_direction { Aim::Along(end) } else { Aim::At(end) };
    Ok(FileCamera { eye, aim, vertical_fov_degrees: fov as f32 })
}

/// Exactly `N` finite numbers.
fn numbers<'a, const N: usize>(words: impl Iterator<Item = &'a [u8]>) -> Result<[f64; N], String> {
    let parsed: Result<Vec<f64>, String> = words
        .map(|word| match Number::from_word(word) {
            Number::Finite(value) => Ok(value),
            _ => Err(format!("`{}` is not a finite number", readable_bytes(word))),
        })
        .collect();
    parsed?.try_into().map_err(|found: Vec<f64>| format!("{N} numbers needed, found {}", found.len()))
}

fn wrong(path: &Path, line: usize, what: String) -> SceneError {
    SceneError::CameraFile { path: path.into(), line, what }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_of_other_systems_is_read() {
        let text = "scene a 1 2 3\nat 0 0 0 0 0 1 60\n";
        let utf_16: Vec<u8> =
            "\u{feff}".encode_utf16().chain(text.encode_utf16()).flat_map(u16::to_be_bytes).collect();
        let expected = parsed(text).unwrap();
        for content in [format!("\u{feff}{text}").into_bytes(), text.replace('\n', "\r").into_bytes(), utf_16]
        {
            assert_eq!(parse(Path::new("a"), &content).unwrap(), expected);
        }
        let names = parse(Path::new("a"), b"scene M\xe4 1 2 3\nscene M\xf6 1 2 3\n").unwrap();
        assert_eq!((names[0].name.as_slice(), names[1].name.as_slice()), (&b"M\xe4"[..], &b"M\xf6"[..]));
    }

    fn parsed(text: &str) -> Result<Vec<FileViews>, SceneError> {
        parse(Path::new("c.txt"), text.as_bytes())
    }

    fn in_place(views: &FileViews) -> Views {
        views.placed(Path::new("c.txt"), |point| point).unwrap()
    }

    #[test]
    fn both_kinds_of_camera_are_read() {
        let all =
            parsed("# mine\nscene a 1 2 3\nat 0 0 0 0 0 -2 60 # front\n\ndir 1 1 1 0 0 -2 75\n").unwrap();
        let cameras = [
            Camera::looking_at([0.0; 3], [0.0, 0.0, -2.0], 60.0),
            Camera::looking_at([1.0; 3], [1.0, 1.0, -1.0], 75.0),
        ];
        assert_eq!((all.len(), all[0].name.as_slice()), (1, &b"a"[..]));
        assert_eq!(in_place(&all[0]), Views { light: [1.0, 2.0, 3.0], sun: None, cameras: cameras.into() });
    }

    #[test]
    fn the_sun_is_a_unit_vector_and_stays_where_it_is() {
        let all = parsed("scene a 1 2 3\nsun 0 3 4\nscene b 1 2 3\n").unwrap();
        assert_eq!((all[0].sun, all[1].sun), (Some([0.0, 0.6, 0.8]), None));
        let views = all[0].placed(Path::new("c"), |point| point.map(|x| 2.0 * x + 1.0)).unwrap();
        assert_eq!((views.light, views.sun), ([3.0, 5.0, 7.0], all[0].sun));
    }

    #[test]
    fn directions_of_distant_cameras_are_kept() {
        let text = "scene a 0 0 0\ndir 4e6 5e6 0 0.6 0.8 0 60\nat 4e6 5e6 0 4000000.006 5000000.008 0 60\n";
        let far = in_place(&parsed(text).unwrap()[0]);
        let near =
            parsed(text).unwrap()[0].placed(Path::new("c"), |[x, y, z]| [x - 4e6, y - 5e6, z]).unwrap();
        for camera in far.cameras.iter().chain(&near.cameras) {
            let [_, _, forward] = camera.frame();
            assert!((forward[0] - 0.6).abs() < 1e-3 && (forward[1] - 0.8).abs() < 1e-3, "{camera:?}");
        }
        let huge = parsed("scene a 1e60 0 0\nat 1e60 0 0 0 0 0 60\n").unwrap();
        assert!(huge[0].placed(Path::new("c"), |point| point).is_err());
        assert!(huge[0].placed(Path::new("c"), |point| point.map(|x| 1e-60 * x)).is_ok());
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
        assert_eq!(read(&path, b"b").unwrap().name, b"a");
        std::fs::write(&path, "scene a 1 2 3\nat 0 0 0 0 0 1 60\nscene b 1 2 3\n").unwrap();
        assert_eq!(read(&path, b"a").unwrap().name, b"a");
        assert!(read(&path, b"b").is_err(), "no cameras");
        assert!(read(&path, b"c").is_err(), "no such scene");
        assert!(matches!(read(&folder.path().join("x"), b"a"), Err(SceneError::NotFound { .. })));
    }
}
