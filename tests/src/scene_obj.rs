//! A small scene from a Wavefront OBJ file with a lamp and the sun: a tiled floor, a mirror wall, a red AABB, and
//! balls of plastic, gold and glass.
#![expect(clippy::expect_used, reason = "a test without its scene has failed")]

use std::fmt::Write as _;
use std::fs::write;
use std::path::{Path, PathBuf};

use lvk::glam::Vec3;
use lvk_samples::app::progress::Progress;
use lvk_samples::scene::{ObjOptions, Scene};

use crate::meshes::Mesh;

const MATERIALS: &str = "
newmtl floor
Kd 1 1 1
Ks 0.3 0.3 0.3
Ns 8
map_Kd tiles.png
newmtl red
Kd 0.8 0.15 0.1
Ks 0.4 0.4 0.4
Ns 60
newmtl plastic
Kd 0.1 0.5 0.2
Ks 0.8 0.8 0.8
Ns 12
newmtl wall
Kd 0.1 0.1 0.1
Ks 0.95 0.95 0.95
Ns 900
illum 3
newmtl gold
Ks 0.95 0.75 0.35
Ns 700
illum 3
newmtl glass
Ks 1 1 1
Ns 1500
Ni 1.5
d 0.05
illum 7
";

const VIEWS: &str = "
scene still_life 1.5 3.5 2.5
sun -0.6 0.7 0.5
at 0.3 1.3 3.6 0.1 0.6 0 55
at -3 1.6 2 0.2 0.5 0 50
at 2.8 0.9 2.2 0 0.6 -0.5 55
at 0.2 3.8 1.2 0.2 0.3 0 60
dir -0.2 0.5 1.8 0.2 0 -1 70
";

/// Loads the scene from files in a temporary folder. It has some 1,600 triangles.
///
/// # Panics
/// When the files cannot be written or read, or are not taken as they are.
pub fn obj_scene() -> Scene {
    let folder = tempfile::tempdir().expect("temporary folders can be made");
    let (obj, cameras) = write_files(folder.path()).expect("files can be written to a temporary folder");
    let options = ObjOptions { cameras: Some(cameras), ..ObjOptions::default() };
    let scene = Scene::from_obj(&obj, &options, &mut Progress::hidden()).expect("the scene can be loaded");
    assert_eq!(scene.warnings, Vec::<String>::new());
    scene
}

fn write_files(folder: &Path) -> std::io::Result<(PathBuf, PathBuf)> {
    let (obj, cameras) = (folder.join("still_life.obj"), folder.join("views.txt"));
    write(&obj, obj_text())?;
    write(&cameras, VIEWS)?;
    write(folder.join("still_life.mtl"), MATERIALS)?;
    let tile = |x: u32, y: u32| match (x / 8 + y / 8) % 2 {
        0 => image::Rgb([230, 225, 210]),
        _ => image::Rgb([40, 70, 120]),
    };
    let tiles = image::RgbImage::from_fn(16, 16, tile);
    tiles.save(folder.join("tiles.png")).map_err(std::io::Error::other)?;
    Ok((obj, cameras))
}

fn obj_text() -> String {
    let mut text = "mtllib still_life.mtl\nvt 0 0\nvt 4 0\nvt 4 4\nvt 0 4\n".to_owned();
    let floor = [[-3.0, 0.0, 3.0], [3.0, 0.0, 3.0], [3.0, 0.0, -3.0], [-3.0, 0.0, -3.0]];
    let wall = [[-2.5, 0.1, -2.0], [2.5, 0.1, -2.0], [2.5, 2.4, -2.0], [-2.5, 2.4, -2.0]];
    add_quad(&mut text, "floor", floor);
    add_quad(&mut text, "wall", wall);
    for face in cube_faces(Vec3::new(-1.3, 0.5, 0.3), 0.4) {
        add_quad(&mut text, "red", face);
    }
    add_ball(&mut text, "plastic", Vec3::new(-0.25, 0.4, 1.0), 0.38);
    add_ball(&mut text, "gold", Vec3::new(0.1, 0.62, -0.6), 0.6);
    add_ball(&mut text, "glass", Vec3::new(1.1, 0.55, 0.6), 0.5);
    text
}

// Indices count back from the last vertex, so that no vertex count is needed.
fn add_quad(text: &mut String, material: &str, corners: [[f32; 3]; 4]) {
    for [x, y, z] in corners {
        let _ = writeln!(text, "v {x} {y} {z}");
    }
    let _ = writeln!(text, "usemtl {material}\nf -4/1 -3/2 -2/3 -1/4");
}

fn add_ball(text: &mut String, material: &str, center: Vec3, radius: f32) {
    let ball = Mesh::sphere(12);
    for point in &ball.positions {
        let normal = Vec3::from(*point);
        let position = center + radius * normal;
        let _ = writeln!(text, "v {} {} {}", position.x, position.y, position.z);
        let _ = writeln!(text, "vn {} {} {}", normal.x, normal.y, normal.z);
    }
    let _ = writeln!(text, "usemtl {material}");
    let count = ball.positions.len() as i64;
    for triangle in &ball.triangles {
        let [a, b, c] = triangle.map(|index| i64::from(index) - count);
        let _ = writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}");
    }
}

/// Returns the faces of a cube, with outer normals.
fn cube_faces(center: Vec3, half: f32) -> [[[f32; 3]; 4]; 6] {
    let turned = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    std::array::from_fn(|side| {
        let (axis, sign) = (side / 2, if side % 2 == 0 { -1.0 } else { 1.0 });
        turned.map(|[u, v]| {
            let mut offset = [0.0; 3];
            offset[axis] = sign;
            offset[(axis + 1) % 3] = u * sign;
            offset[(axis + 2) % 3] = v;
            (center + half * Vec3::from(offset)).to_array()
        })
    })
}
