//! Files as exporters write them, each beside a plain file that means the same.

use super::{Material, ObjOptions, Scene, SceneError};
use crate::app::progress::Progress;

/// A quad, a triangle on its edge, and texture coordinates.
const VERTICES: &str = "v 0.0 0.0 0.0\nv 2.0 0.0 0.0\nv 2.0 1.5 0.0\nv 0.0 1.5 0.0\nv 1.0 2.5 0.5\n";
const TEXCOORDS: &str = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
const FACES: &str = "f 1 2 3 4\nf 4 3 5\n";
const TEXTURED_FACES: &str = "f 1/1 2/2 3/3 4/4\nf 4/1 3/2 5/3\n";
const PAINT: &str = "Kd 0.8 0.1 0.1\n";

/// Content of files by their names.
type Files = Vec<(String, Vec<u8>)>;

fn file(name: &str, content: impl AsRef<[u8]>) -> (String, Vec<u8>) {
    (name.into(), content.as_ref().into())
}

fn plain() -> String {
    [VERTICES, FACES].concat()
}

/// The mesh with a material `m` of a library `a.mtl`.
fn painted() -> String {
    format!("mtllib a.mtl\n{VERTICES}usemtl m\n{FACES}")
}

fn with_library(obj: impl AsRef<[u8]>, library: impl AsRef<[u8]>) -> Files {
    vec![file("a.obj", obj), file("a.mtl", library)]
}

fn with_material(lines: &str) -> Files {
    with_library(painted(), format!("newmtl m\n{lines}"))
}

fn png() -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let texel = |x, y| image::Rgb([50 * x as u8, 100 * y as u8, 7]);
    image::RgbImage::from_fn(4, 2, texel).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// The mesh with an image at `place` that the line `map` names.
fn with_image(map: &str, place: &str) -> Files {
    let obj = format!("mtllib a.mtl\n{VERTICES}{TEXCOORDS}usemtl m\n{TEXTURED_FACES}");
    vec![file("a.obj", obj), file("a.mtl", format!("newmtl m\nKd 1 1 1\n{map}\n")), file(place, png())]
}

/// The same files in a folder, but for images that lead out of it.
fn in_folder(folder: &str, files: Files) -> Files {
    let moved = |(name, content): (String, Vec<u8>)| match name.strip_prefix("../") {
        Some(outside) => (outside.to_owned(), content),
        None => (format!("{folder}/{name}"), content),
    };
    files.into_iter().map(moved).collect()
}

/// Loads the only OBJ file.
fn load(files: &Files) -> Result<Scene, SceneError> {
    let folder = tempfile::tempdir().unwrap();
    let mut obj = folder.path().to_path_buf();
    for (name, content) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, content).unwrap();
        if path.extension() == Some("obj".as_ref()) {
            obj = path;
        }
    }
    Scene::from_obj(&obj, &ObjOptions::default(), &mut Progress::hidden())
}

/// Everything that the image depends on.
fn content(scene: &Scene) -> (Vec<impl PartialEq + std::fmt::Debug + use<>>, Vec<Material>, Vec<Vec<u8>>) {
    let corner = |vertex: u32| {
        let i = vertex as usize;
        (scene.positions[i], scene.normals[i], scene.texcoords[i], scene.colors.get(i).copied())
    };
    let triangle = |(vertices, material): (&[u32; 3], &u32)| {
        (vertices.map(corner), *material, scene.opaque_triangle_count)
    };
    let nameless = |material: &Material| Material { name: String::new(), ..material.clone() };
    (
        scene.triangles.iter().zip(&scene.triangle_materials).map(triangle).collect(),
        scene.materials.iter().map(nameless).collect(),
        scene.textures.iter().map(|texture| texture.pixels.clone()).collect(),
    )
}

/// Checks that the files mean the same as the plain ones, and that exactly the warnings appear of which parts are given.
#[track_caller]
fn assert_means(exporter: &str, files: &Files, plain: &Files, warnings: &[&str]) {
    let found = load(files).unwrap_or_else(|error| panic!("{exporter}: {error}"));
    assert_eq!(content(&found), content(&load(plain).unwrap()), "{exporter}");
    assert_eq!(found.warnings.len(), warnings.len(), "{exporter}: {:?}", found.warnings);
    for (line, part) in found.warnings.iter().zip(warnings) {
        assert!(line.contains(part), "{exporter}: `{part}` is not in {line}");
    }
}

fn obj(text: impl AsRef<[u8]>) -> Files {
    vec![file("a.obj", text)]
}

#[test]
fn headers_groups_and_curves_change_nothing() {
    let vp = "vp 0.3 0.4 1\ncstype rat bspline\ndeg 2 2\nsurf 0 1 0 1 1 2 3 4 \\\n5 1\nparm u 0 0 0 \\\n1 1\nend\n";
    let maya =
        "g default\nusemap off\nbevel off\nlod 0\nshadow_obj x\ng default pCube1 polySurface2\ns off\n";
    for (exporter, text) in [
        (
            "Blender",
            format!("# Blender 4.1.0\n# www.blender.org\no My Cube.001\n{VERTICES}s 0\n{FACES}l 1 2\np 3\n"),
        ),
        ("Rhino", format!("# Rhino\n\n{VERTICES}{vp}f 1 \\\n2 \\\n3 4\nf 4 3 5\n")),
        (
            "Maya",
            format!(
                "# This file uses centimeters as units for non-parametric coordinates.\n\n{maya}{}",
                plain()
            ),
        ),
        ("Wings 3D", format!("o cube1\n#5 vertices, 2 faces\n{VERTICES}vn 0 1 0\ng cube1_auv\n{FACES}")),
        ("MakeHuman", format!("{VERTICES}g body\nf 1/ 2/ 3/ 4/\nf 4// 3// 5//\n")),
        ("Tinkercad", plain().replace(' ', " \t\t ")),
        ("3ds Max", format!("#\n# object Box001\n#\n\n{}", plain()).replace('\n', "  \r\n")),
        ("Houdini", plain().replace(".0\n", ".0 1\n").replace("0.5\n", "0.5 1\n")),
        ("empty groups", format!("{VERTICES}g\no\ns\nusemtl\n{FACES}g end\no end\n")),
        ("relative indices", format!("{VERTICES}f -5 -4 -3 -2\nf -2 3 -1\n")),
        ("faces first", [FACES, VERTICES].concat()),
    ] {
        assert_means(exporter, &obj(text), &obj(plain()), &[]);
    }
}

#[test]
fn text_that_other_programs_mangled_is_read() {
    let mark = "\u{feff}";
    for (how, text) in [
        ("twice written as text", plain().replace('\n', "\r\r\n")),
        (
            "twice written as text, continued",
            format!("{VERTICES}f 1 2 \\\n3 4\nf 4 3 5\n").replace('\n', "\r\r\n"),
        ),
        ("padded with zeros", plain() + &"\0".repeat(512)),
        ("end mark of DOS", plain() + "\x1a\0\0"),
        ("put together of two files", format!("{mark}# a\r\n{mark}{}", plain().replace('\n', "\r\n"))),
        ("capitals", plain().to_ascii_uppercase()),
    ] {
        assert_means(how, &obj(text), &obj(plain()), &[]);
    }
    let library = format!("newmtl m\n{PAINT}");
    for end in ["\0\0\0", "\x1a"] {
        assert_means(
            end,
            &with_library(painted(), library.trim_end().to_owned() + end),
            &with_material(PAINT),
            &[],
        );
    }
}

#[test]
fn numbers_of_other_languages_are_read() {
    for (how, text) in [
        ("decimal commas", plain().replace('.', ",")),
        ("no zeros", plain().replace("0.0", ".0").replace("2.0", "2.")),
        ("signs", plain().replace("v ", "v +").replace("f ", "f +")),
        ("Fortran", plain().replace("2.5", "0.25D+01").replace("1.5", "15d-1")),
        ("many digits", plain().replace("1.5", &format!("1.5{}", "0".repeat(400)))),
        ("decimals of indices", format!("{VERTICES}f 1.0 2.000000 3. 4\nf 4 3 5.0\n")),
    ] {
        assert_means(how, &obj(text), &obj(plain()), &[]);
    }
    assert_means("commas", &with_material("Kd 0,8 0,1 0,1\n"), &with_material(PAINT), &[]);
    for (text, line) in
        [("v 0x10 0 0\n", "a.obj:1"), ("v 0 0 0\nf 1.5 1 1\n", "a.obj:2"), ("v 1,2,3 4 5\n", "a.obj:1")]
    {
        let error = load(&obj(text)).unwrap_err().to_string();
        assert!(error.contains(line), "{error}");
    }
}

#[test]
fn lines_that_are_no_statements_are_named() {
    let text = format!("Exported by me\n{VERTICES}vc 1 0 0\n{FACES}");
    assert_means("unknown", &obj(text), &obj(plain()), &["a.obj:1: `Exported`", "a.obj:7: `vc`"]);
}

#[test]
fn colors_of_meshlab_and_zbrush_are_those_of_vertices() {
    let colored = |end: &str| {
        obj(plain().replace(".0\n", &format!(".0 {end}\n")).replace("0.5\n", &format!("0.5 {end}\n")))
    };
    let expected = colored("0.4 0.2 0.6");
    assert_means("MeshLab", &colored("0.4 0.2 0.6 1.0"), &expected, &[]);
    assert_means("bytes", &colored("102 51 153"), &expected, &["0 to 255"]);
    let paint = format!(
        "#The following MRGB block contains ...\n#MRGB {}\n#MRGB {}\n",
        "ff663399".repeat(3),
        "00663399".repeat(2)
    );
    assert_means(
        "ZBrush",
        &obj(format!("{VERTICES}{paint}# End of MRGB block\ng default\n{FACES}")),
        &expected,
        &[],
    );
    assert_means("Blender", &obj(format!("{FACES}{VERTICES}{paint}")), &expected, &[]);
    let part = format!("v 9 9 9\n{VERTICES}#MRGB ff0000ffffff0000\nf 2 3 4 5\nf 5 4 6\n");
    let scene = load(&obj(part)).unwrap();
    let of_last = |place: [f32; 3]| scene.colors[scene.positions.iter().position(|p| *p == place).unwrap()];
    assert_eq!((of_last([0.0, 1.5, 0.0]), of_last([1.0, 2.5, 0.5])), ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]));
    assert_eq!(of_last([0.0; 3]), [1.0; 3], "paint is for the last vertices");
}

#[test]
fn materials_of_exporters_look_as_in_the_exporter() {
    let pbr = "Ns 0.000000\nKa 1 1 1\nKs 0.5 0.5 0.5\nKe 0 0 0\nNi 1.5\nd 1.0\nillum 1\nPr 0.5\nPm 0\nPs 0\nPc 0.2\nPcr 0.03\naniso 0\n";
    for (exporter, lines) in [
        ("Blender", pbr),
        ("Maya", "illum 4\nKa 0.00 0.00 0.00\nTf 1.00 1.00 1.00\nNi 1.00\n"),
        ("Cinema 4D", "Ka 1 1 1\nKs 0 0 0\nNs 50\nd 1.0\nillum 4\n"),
        ("3ds Max", "\tNs 10\n\tNi 1.5\n\td 1.0\n\tTr 0.0\n\tTf 1 1 1 \n\tillum 2\n\tKs 0 0 0\n"),
        ("older MeshLab", "Ka 0.2 0.2 0.2\nKs 1 1 1\nTr 1.000000\nillum 2\nNs 0.000000\n"),
        ("MeshLab", "Ka 0.2 0.2 0.2\nKs 1 1 1\nTr 0.000000\nillum 2\nNs 0.000000\n"),
        ("Metashape", "Ka 1 1 1\nKs 0 0 0\nd 1.0\nNs 0.0\nillum 0\n"),
        ("Lambert's model", "Ks 1 1 1\nNs 10\nillum 1\n"),
        ("halo", "d -halo 1.0\n"),
        ("spectral", "Ka spectral a.rfl\nKd xyz 1 1 1\n"),
    ] {
        let found = load(&with_material(&format!("{PAINT}{lines}"))).unwrap();
        let material = &found.materials[0];
        let looks = (material.albedo, material.specular, material.transmission, material.reflectivity);
        assert_eq!(looks, ([0.8, 0.1, 0.1], [0.0; 3], 0.0, 0.0), "{exporter}");
        assert!(found.warnings.is_empty(), "{exporter}: {:?}", found.warnings);
    }
    let passes = |lines: &str| load(&with_material(lines)).unwrap().materials[0].transmission;
    assert!((passes("illum 4\nTf 0.40 0.30 0.20\nNi 1.00\n") - 0.6).abs() < 1e-6, "Maya's transparency");
    assert_eq!(passes("illum 7\nNi 1.5\nTf 1 1 1\n"), 0.9, "glass");
    assert_eq!(passes("illum 7\nNi 1.5\nd 1\n"), 0.9, "refraction is asked for");
    assert_eq!(passes("illum 9\nNi 1.5\nd 1\n"), 0.0);
    assert_eq!(passes("illum 6\nNi 1\nd 1\n"), 0.0);
}

#[test]
fn images_come_from_where_archives_have_them() {
    let expected = with_image("map_Kd t.png", "t.png");
    for (map, place) in [
        ("map_Kd C:\\Users\\me\\3dsMax\\sceneassets\\images\\T.PNG", "t.png"),
        ("map_Kd \\\\server\\share\\t.png", "t.png"),
        ("map_Kd .\\Maps/T.png", "maps/t.png"),
        ("map_Kd my%20tex.png", "my tex.png"),
        ("map_Kd h%C3%B6he.png", "h\u{f6}he.png"),
        ("map_Kd file:///C:/x/t.png", "t.png"),
        ("map_Kd   \"t x.png\"  ", "t x.png"),
        ("map_Kd t.png\nmap_bump t.png -bm 0.30\nrefl -type sphere -mm 0 1 clouds.mpc", "t.png"),
    ] {
        assert_means(map, &with_image(map, place), &expected, &[]);
    }
    let absolute = with_image("map_Kd D:\\work\\t.png", "../textures/t.png");
    assert_means("Sketchfab", &in_folder("source", absolute), &expected, &[]);
    assert_means(
        "folder above",
        &in_folder("sub", with_image("map_Kd ..\\T.png", "../t.png")),
        &expected,
        &[],
    );
    for (map, place) in [("t.png", "t.png"), ("img\\t.png", "img/t.png")] {
        let mut files = with_image(&format!("map_Kd {map}"), place);
        files[0].1 = String::from_utf8(files[0].1.clone()).unwrap().replace("a.mtl", "lib/a.mtl").into();
        files[1].0 = "lib/a.mtl".into();
        assert_means("images beside the OBJ", &files, &expected, &[]);
    }
}

#[test]
fn renamed_libraries_are_read() {
    let library = format!("newmtl m\n{PAINT}");
    let expected = with_material(PAINT);
    let renamed = with_library(painted().replace("a.mtl", "untitled.mtl"), &library);
    assert_means(
        "renamed",
        &renamed,
        &expected,
        &["untitled.mtl: no such file", "a.mtl has the name of the OBJ file"],
    );
    let unnamed = with_library(painted().replace("mtllib a.mtl\n", ""), &library);
    assert_means("unnamed", &unnamed, &expected, &["a.mtl has the name of the OBJ file"]);
    let tiles = with_library(painted().replace("a.mtl", "a.mtl\nmtllib ./a.mtl\nmtllib lost.mtl"), &library);
    assert_means("tiles", &tiles, &expected, &["lost.mtl"]);
    assert_means("no materials", &with_library(plain(), &library), &obj(plain()), &[]);
}

#[test]
fn options_of_images_are_applied_or_named() {
    let mapped = |scale: [f32; 2], offset: [f32; 2]| {
        let texcoord =
            |[u, v]: [f32; 2]| format!("vt {} {}\n", u * scale[0] + offset[0], v * scale[1] + offset[1]);
        let texcoords: String = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(texcoord).concat();
        let mut files = with_image("map_Kd t.png", "t.png");
        files[0].1 = String::from_utf8(files[0].1.clone()).unwrap().replace(TEXCOORDS, &texcoords).into();
        files
    };
    for (options, scale, offset) in [
        ("-s 2 3 1", [2.0, 3.0], [0.0; 2]),
        ("-s 2", [2.0, 1.0], [0.0; 2]),
        ("-o 0.25 0.5 0", [1.0; 2], [0.25, 0.5]),
        ("-o 0.25 0.5 0 -s 2 2 1", [2.0; 2], [0.25, 0.5]),
        ("-s 1 1 1 -o 0 0 0 -mm 0 1 -clamp off -blendu on -texres 512", [1.0; 2], [0.0; 2]),
    ] {
        let files = with_image(&format!("map_Kd {options} t.png"), "t.png");
        assert_means(options, &files, &mapped(scale, offset), &[]);
    }
    let ignored = with_image("map_Kd -clamp on -mm 0.2 0.5 t.png", "t.png");
    assert_means("ignored", &ignored, &mapped([1.0; 2], [0.0; 2]), &["`-clamp on`", "`-mm 0.2 0.5`"]);
}

#[test]
fn doubled_and_degenerate_faces_do_no_harm() {
    let reversed = "f 4 3 2 1\nf 5 3 4\n";
    let scene = load(&obj(format!("{VERTICES}{FACES}{reversed}"))).unwrap();
    assert_eq!((scene.triangles.len(), scene.warnings.len()), (6, 0));
    let along = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|v| glam::Vec3::from(scene.positions[v as usize]));
        let normal = (b - a).cross(c - a).normalize();
        triangle.iter().all(|v| normal.dot(scene.normals[*v as usize].into()) > 0.6)
    };
    assert!(scene.triangles.iter().all(along), "back faces have normals of their own");
    let odd = format!("{VERTICES}f 1 1 2 3 3 4 1\nf 4 3 5\nf 1 1 1\nf 1 2\nf\n");
    assert_means("repeated", &obj(odd), &obj(plain()), &["fewer than 3", "without area"]);
}
