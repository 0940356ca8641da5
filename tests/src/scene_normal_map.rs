//! A scene for normal maps: four floor tiles with differently oriented texture coordinates, tilted by a map or by
//! vertex normals. Both must look the same.
#![expect(clippy::expect_used, reason = "a test whose scene cannot be made has failed")]

use std::fmt::Write as _;
use std::path::Path;

use image::{ImageResult, Rgb, RgbImage};
use lvk_samples::app::progress::Progress;
use lvk_samples::scene::{ObjOptions, Scene};

/// Normal of every texel of the map, as stored: to the right, up and off the surface.
const STORED: [u8; 3] = [192, 90, 226];

/// Source of the tiles' normals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tilt {
    /// A normal map.
    Map,
    /// Vertex normals.
    Vertices,
}

/// Directions of u and v on each tile, along x and z.
const WAYS: [[[f32; 2]; 2]; 4] = [
    [[1.0, 0.0], [0.0, -1.0]],
    // Turned,
    [[0.0, -1.0], [-1.0, 0.0]],
    // and mirrored.
    [[-1.0, 0.0], [0.0, -1.0]],
    [[1.0, 0.0], [0.0, 1.0]],
];

/// Loads tiles of 2 units a side beside each other along x, with the sun at the right.
///
/// # Panics
/// When its files cannot be written or read, or are not taken as they are.
#[must_use]
pub fn normal_map_scene(tilt: Tilt) -> Scene {
    let folder = tempfile::tempdir().expect("temporary folders can be made");
    write_files(folder.path(), tilt).expect("files can be written");
    let options = ObjOptions {
        cameras: Some(folder.path().join("views.txt")),
        normal_maps: tilt == Tilt::Map,
        ..ObjOptions::default()
    };
    let scene = Scene::from_obj(&folder.path().join("a.obj"), &options, &mut Progress::hidden());
    let scene = scene.expect("the scene is sound");
    assert_eq!(scene.warnings, Vec::<String>::new());
    scene
}

fn write_files(folder: &Path, tilt: Tilt) -> ImageResult<()> {
    RgbImage::from_pixel(16, 16, Rgb(STORED)).save(folder.join("tilt.png"))?;
    let mtl = "newmtl tile\nKd 0.6 0.6 0.6\nKs 0.5 0.5 0.5\nNs 20\nnorm tilt.png\n";
    let views = "scene a 0 3 0\nsun 0.6 0.8 0\ndir 0 7 0 0.0001 -1 0 60\n";
    let mut obj = "mtllib a.mtl\nusemtl tile\n".to_owned();
    WAYS.iter().enumerate().for_each(|(number, way)| add_tile(&mut obj, number, *way, tilt));
    for (name, text) in [("a.mtl", mtl), ("a.obj", &obj), ("views.txt", views)] {
        std::fs::write(folder.join(name), text)?;
    }
    Ok(())
}

fn add_tile(obj: &mut String, number: usize, [right, up]: [[f32; 2]; 2], tilt: Tilt) {
    let middle = 2.0 * number as f32 - 3.0;
    for [x, z] in [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]] {
        let along = |way: [f32; 2]| 0.5 + 0.5 * (way[0] * x + way[1] * z);
        let _ = writeln!(obj, "v {} 0 {z}\nvt {} {}", middle + x, along(right), along(up));
    }
    let [x, y, z] = STORED.map(|stored| f32::from(stored) / 127.5 - 1.0);
    let normal = match tilt {
        Tilt::Map => [0.0, 1.0, 0.0],
        Tilt::Vertices => [x * right[0] + y * up[0], z, x * right[1] + y * up[1]],
    };
    let _ = writeln!(obj, "vn {} {} {}", normal[0], normal[1], normal[2]);
    let corner = |place: usize| format!("{0}/{0}/{1}", 4 * number + place, number + 1);
    let _ = writeln!(obj, "f {} {} {} {}", corner(1), corner(2), corner(3), corner(4));
}
