//! A scene for shadows and alpha masks: a board with a hole over a floor, seen from above, with the sun at one side.
#![expect(clippy::expect_used, reason = "a test whose scene cannot be made has failed")]

use std::path::Path;

use image::{ImageResult, Rgb, RgbImage};
use lvk_samples::app::progress::Progress;
use lvk_samples::scene::{ObjOptions, Scene};

const MATERIALS: &str = "newmtl floor
Kd 0.8 0.8 0.8
newmtl board
Kd 1 1 1
map_Kd red.png
map_d mask.png
";

const GEOMETRY: &str = "mtllib a.mtl
vt 0 0
vt 1 0
vt 1 1
vt 0 1
v -4 0 4
v 4 0 4
v 4 0 -4
v -4 0 -4
usemtl floor
f 1/1 2/2 3/3 4/4
v -1 2 1
v 1 2 1
v 1 2 -1
v -1 2 -1
usemtl board
f 5/1 6/2 7/3 8/4
";

/// The sun stands to the right: shadows fall 1.5 to the left for 2 of height.
const VIEWS: &str = "scene a 0 3 0
sun 0.6 0.8 0
dir 0 9 0 0.0001 -1 0 60
";

/// Loads a white floor of 8 units a side, and 2 above it a red board of 2 a side with a hole of half a unit in its
/// middle. The first camera looks down from 9 above the floor.
///
/// # Panics
/// When its files cannot be written or read, or are not taken as they are.
#[must_use]
pub fn shadow_mask_scene() -> Scene {
    let folder = tempfile::tempdir().expect("temporary folders can be made");
    write_files(folder.path()).expect("files can be written");
    let options = ObjOptions { cameras: Some(folder.path().join("views.txt")), ..ObjOptions::default() };
    let scene = Scene::from_obj(&folder.path().join("a.obj"), &options, &mut Progress::hidden());
    let scene = scene.expect("the scene is sound");
    assert_eq!(scene.warnings, Vec::<String>::new());
    scene
}

fn write_files(folder: &Path) -> ImageResult<()> {
    let mask = RgbImage::from_fn(64, 64, |x, y| {
        let is_hole = (24..40).contains(&x) && (24..40).contains(&y);
        Rgb([if is_hole { 0 } else { 255 }; 3])
    });
    mask.save(folder.join("mask.png"))?;
    RgbImage::from_pixel(64, 64, Rgb([220, 40, 40])).save(folder.join("red.png"))?;
    for (name, text) in [("a.mtl", MATERIALS), ("a.obj", GEOMETRY), ("views.txt", VIEWS)] {
        std::fs::write(folder.join(name), text)?;
    }
    Ok(())
}
