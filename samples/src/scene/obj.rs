//! Loads a Wavefront OBJ file: parse, check, place, put together, mend normals, arrange, light and frame.

use std::path::Path;

use super::mesh::Mesh;
use super::mtl::{Library, Selection};
use super::obj_text::{self, ObjText};
use super::placement::Placement;
use super::setting::Setting;
use super::texcoord_mapping::Mapping;
use super::{
    Material, ObjOptions, Scene, SceneError, benchmark, camera_file, normals, obj_mesh, texcoord_mapping,
    vertex_colors,
};
use crate::app::input_file::{self, FileKind};
use crate::app::progress::Progress;

/// Implements [`Scene::from_obj`].
pub(super) fn load(path: &Path, options: &ObjOptions, progress: &mut Progress) -> Result<Scene, SceneError> {
    let stem = path.file_stem().unwrap_or_default();
    let name = stem.to_string_lossy().into_owned();
    if let Some(scale) = options.scale.filter(|scale| !(scale.is_finite() && *scale > 0.0)) {
        return Err(SceneError::BadScale { scale });
    }
    let own_views = options.cameras.as_ref().map(|file| camera_file::read(file, stem.as_encoded_bytes()));
    let own_views = own_views.transpose()?.zip(options.cameras.as_ref());
    let mut obj = read_text(path, &name, progress)?;
    let extent = obj_mesh::check(path, &mut obj)?;
    let benchmark = benchmark::find(&name, obj.triangle_count);
    let scale = options.scale.or(benchmark.as_ref().map(|known| known.scale)).unwrap_or(1.0);
    let placement = Placement::new(&extent, scale);
    placement.warnings().into_iter().for_each(|line| obj.warnings.push("placement", line));
    let own_views = own_views.map(|(views, file)| views.placed(file, |point| placement.place_point(point)));
    let views = own_views.transpose()?.or(benchmark.map(|known| known.views));
    let colors = vertex_colors::linear(std::mem::take(&mut obj.colors), &mut obj.warnings);
    progress.stage(&format!("{name}: putting faces together"), obj.faces.len() as u64);
    let mut mesh = obj_mesh::build(path, &mut obj, &colors, &placement, progress)?;
    let degenerate = mesh.drop_degenerate();
    if mesh.triangles.is_empty() {
        return Err(SceneError::Empty { path: path.into(), degenerate });
    }
    let names = names_in_use(&mut mesh, &obj.materials);
    progress.stage(&format!("{name}: textures"), 0);
    let library = read_library(path, &obj, options, !colors.is_empty());
    let Selection { materials, mappings, textures, normal_maps, warnings: of_materials } =
        library.select(&names);
    let mut warnings = obj.warnings.into_lines();
    warnings.extend(of_materials);
    progress.go_on()?;
    progress.stage(&format!("{name}: arranging triangles"), 0);
    let opaque_triangle_count = finish(&mut mesh, &materials, &mappings, &mut warnings, degenerate);
    let setting = Setting::from_mesh(&mesh, views);
    Ok(Scene {
        opaque_triangle_count,
        textures,
        normal_maps,
        degenerate_triangle_count: degenerate as u32,
        resize: placement.resize(),
        warnings,
        ..setting.into_scene(name, mesh, materials)
    })
}

fn read_text(path: &Path, name: &str, progress: &mut Progress) -> Result<ObjText, SceneError> {
    let (file, size) = input_file::open_named_by_user(path, FileKind::Obj)
        .map_err(|source| SceneError::from_io(path, source))?;
    progress.stage(&format!("{name}: reading"), size.unwrap_or(0));
    obj_text::parse(path, file, progress)
}

fn read_library(path: &Path, obj: &ObjText, options: &ObjOptions, has_colors: bool) -> Library {
    let library = Library::read(path, &obj.libraries);
    let is_unnamed = obj.libraries.is_empty() && obj.materials.len() > 1;
    let library = if is_unnamed { library.with_namesake_of(path) } else { library };
    let library = if options.normal_maps { library.with_normal_maps() } else { library };
    if has_colors { library.with_vertex_colors() } else { library }
}

/// Renumbers the materials so that only used ones are left; returns their names.
fn names_in_use(mesh: &mut Mesh, names: &[Option<Vec<u8>>]) -> Vec<Option<Vec<u8>>> {
    let mut used = vec![false; names.len()];
    mesh.triangle_materials.iter().for_each(|&material| used[material as usize] = true);
    let mut next = 0;
    let numbers: Vec<u32> = used
        .iter()
        .map(|&is_used| {
            let number = next;
            next += u32::from(is_used);
            number
        })
        .collect();
    mesh.triangle_materials.iter_mut().for_each(|material| *material = numbers[*material as usize]);
    names.iter().zip(used).filter(|(_, is_used)| *is_used).map(|(name, _)| name.clone()).collect()
}

fn finish(
    mesh: &mut Mesh,
    materials: &[Material],
    mappings: &[Option<Mapping>],
    warnings: &mut Vec<String>,
    degenerate: usize,
) -> u32 {
    if degenerate > 0 {
        warnings.push(format!("{degenerate} triangles without area were left out"));
    }
    normals::complete(mesh);
    texcoord_mapping::apply(mesh, mappings);
    mesh.arrange(materials)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Loads `text` from a folder that also holds `files`.
    fn load_text(text: impl AsRef<[u8]>, files: &[(&str, &[u8])]) -> Result<Scene, SceneError> {
        let folder = tempfile::tempdir().unwrap();
        for (name, content) in files {
            std::fs::write(folder.path().join(name), content).unwrap();
        }
        let path = folder.path().join("mesh.obj");
        std::fs::write(&path, text.as_ref()).unwrap();
        load(&path, &ObjOptions::default(), &mut Progress::hidden())
    }

    const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n";

    fn assert_consistent(scene: &Scene) {
        let vertex_count = scene.positions.len();
        assert_eq!(scene.normals.len(), vertex_count);
        assert_eq!(scene.texcoords.len(), vertex_count);
        assert!(scene.colors.is_empty() || scene.colors.len() == vertex_count);
        assert!(scene.triangles.iter().flatten().all(|&v| (v as usize) < vertex_count));
        assert_eq!(scene.triangle_materials.len(), scene.triangles.len());
        assert_eq!(scene.source_triangles.len(), scene.triangles.len());
        assert!(scene.triangle_materials.iter().all(|&m| (m as usize) < scene.materials.len()));
        let textures = scene.textures.len() as u32;
        assert!(scene.materials.iter().filter_map(|m| m.albedo_texture).all(|t| t < textures));
        for normal in &scene.normals {
            let length = glam::Vec3::from(*normal).length();
            assert!((length - 1.0).abs() < 1e-3, "{normal:?}");
        }
        for camera in &scene.cameras {
            assert!(camera.eye.iter().chain(&camera.target).all(|x| x.is_finite()));
            assert_ne!(camera.eye, camera.target);
        }
    }

    #[test]
    fn polygons_become_fans_numbered_in_the_order_of_the_file() {
        let scene = load_text(format!("{TRIANGLE}f 1 2 4 3\nf 1 2 3\n"), &[]).unwrap();
        assert_consistent(&scene);
        let mut sources = scene.source_triangles.clone();
        sources.sort_unstable();
        assert_eq!(sources, [0, 1, 2]);
        assert_eq!(scene.triangles.len(), 3);
        assert_eq!(scene.name, "mesh");
    }

    #[test]
    fn corners_without_normals_beside_corners_with_them_are_not_mixed_up() {
        let text = format!("{TRIANGLE}v 0 0 1\nv 1 0 1\nvn 0 0 -1\nf 1//1 2//1 3//1\nf 1 5 2\nf 2 5 6\n");
        let scene = load_text(&text, &[]).unwrap();
        assert_consistent(&scene);
        for (triangle, &source) in scene.triangles.iter().zip(&scene.source_triangles) {
            let expected = if source == 0 { [0.0, 0.0, -1.0] } else { [0.0, 1.0, 0.0] };
            for &vertex in triangle {
                let normal = scene.normals[vertex as usize];
                let off = glam::Vec3::from(normal).distance(expected.into());
                assert!(off < 1e-5, "triangle {source}: {normal:?}");
            }
        }
    }

    #[test]
    fn a_mesh_far_from_its_origin_keeps_its_shape() {
        let text = "v 4000000.0 5e6 0\nv 4000000.25 5e6 0\nv 4000000.0 5000000.125 0\nf 1 2 3\n";
        let scene = load_text(text, &[]).unwrap();
        assert_consistent(&scene);
        let (low, high) = scene.bounds();
        assert_eq!((high[0] - low[0], high[1] - low[1]), (0.25, 0.125));
        assert!(scene.warnings[0].contains("far from its origin"), "{:?}", scene.warnings);
    }

    #[test]
    fn texture_coordinates_run_down() {
        let scene = load_text(format!("{TRIANGLE}vt 0.25 1\nf 1/1 2/1 3/1\n"), &[]).unwrap();
        assert!(scene.texcoords.iter().all(|&t| t == [0.25, 0.0]));
    }

    #[test]
    fn glass_comes_after_opaque_triangles() {
        let mtl = b"newmtl glass\nillum 7\nnewmtl wall\nKd 1 0 0\n";
        let text = format!("mtllib a.mtl\n{TRIANGLE}usemtl glass\nf 1 2 3\nusemtl wall\nf 2 3 4\nf 1 2 4\n");
        let scene = load_text(&text, &[("a.mtl", mtl)]).unwrap();
        assert_consistent(&scene);
        assert_eq!(scene.opaque_triangle_count, 2);
        assert_eq!(scene.source_triangles[2], 0);
        assert!(scene.materials[scene.triangle_materials[2] as usize].is_refractive());
        assert_eq!(scene.warnings, Vec::<String>::new());
    }

    #[test]
    fn flaws_are_mended_with_a_warning_that_names_them() {
        let mtl = b"newmtl wall\nmap_Kd absent.png\n";
        let text = format!(
            "mtllib a.mtl lost.mtl\n{TRIANGLE}usemtl light\nf 1 2 3\nusemtl wall\nf 2 3 4\nf 1 1 2\n"
        );
        let scene = load_text(&text, &[("a.mtl", mtl)]).unwrap();
        assert_consistent(&scene);
        let warnings = scene.warnings.join("\n");
        for name in ["`light`", "absent.png", "lost.mtl", "1 triangles without area"] {
            assert!(warnings.contains(name), "{name} in {warnings}");
        }
        assert_eq!(scene.degenerate_triangle_count, 1);
        assert_eq!(scene.textures.len(), 1);
    }

    #[test]
    fn an_image_that_two_materials_use_is_loaded_once() {
        let mut png = std::io::Cursor::new(Vec::new());
        image::RgbaImage::new(2, 1).write_to(&mut png, image::ImageFormat::Png).unwrap();
        let mtl = b"newmtl a\nmap_Kd t.png\nnewmtl b\nmap_Kd T.PNG\n";
        let text = format!("mtllib a.mtl\n{TRIANGLE}usemtl a\nf 1 2 3\nusemtl b\nf 2 3 4\n");
        let scene = load_text(&text, &[("a.mtl", mtl), ("t.png", png.get_ref())]).unwrap();
        assert_eq!(scene.textures.len(), 1);
        assert_eq!((scene.textures[0].width, scene.textures[0].height), (2, 1));
    }

    #[test]
    fn scenes_that_cannot_be_drawn_are_refused() {
        let missing = load(Path::new("/nowhere/a.obj"), &ObjOptions::default(), &mut Progress::hidden());
        assert!(matches!(missing, Err(SceneError::NotFound { .. })));
        let flat = load_text("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", &[]);
        assert!(matches!(flat, Err(SceneError::Empty { degenerate: 1, .. })));
        // A line does not count for the size of the mesh, so it may be longer than single precision reaches.
        let long = load_text("v 4e6 5e6 0\nv 4000000.25 5e66 5e6\nv 0 -1e30 1\nf 1 2 3\n", &[]);
        assert!(matches!(long, Err(SceneError::Empty { degenerate: 1, .. })));
        let folder = tempfile::tempdir().unwrap();
        let unreadable = load(folder.path(), &ObjOptions::default(), &mut Progress::hidden());
        assert!(matches!(unreadable, Err(SceneError::Unreadable { .. })));
    }

    #[test]
    fn the_scale_applies_and_is_checked() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("conference.obj");
        std::fs::write(&path, format!("{TRIANGLE}f 1 2 3\n")).unwrap();
        let width = |scale| {
            let options = ObjOptions { scale, ..ObjOptions::default() };
            load(&path, &options, &mut Progress::hidden()).map(|scene| scene.bounds().1[0])
        };
        assert_eq!(width(Some(2.0)).unwrap(), 2.0);
        assert_eq!(width(None).unwrap(), 1.0, "a namesake of a benchmark scene is not scaled");
        for bad in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert!(matches!(width(Some(bad)), Err(SceneError::BadScale { .. })), "{bad}");
        }
    }

    /// The same triangle near and far, and a vertex at the origin that no face uses.
    #[test]
    fn only_vertices_in_use_count_for_the_extent() {
        let near = "v 0 0 0\nv 1 0 0\nv 0 1 0.5\n";
        let far = "v 500000 5000000 100\nv 500001 5000000 100\nv 500000 5000001 100.5\n";
        let used = load_text(format!("{near}f 1 2 3\n"), &[]).unwrap();
        for unused in [
            "",
            "v 0 0 0\n",
            "v nan inf -1.#IND00\n",
            "v 1e300 0 0\n",
            "v 0 0 0\nf 4 4 4\nf 4 1 4\n",
            "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 4 5 6\n",
        ] {
            let found = load_text(format!("{far}{unused}f 1 2 3\n"), &[]).unwrap();
            let size = |scene: &Scene| {
                let (low, high) = scene.bounds();
                [0, 1, 2].map(|i| high[i] - low[i])
            };
            assert_eq!(size(&found), size(&used), "{unused}");
            assert!(found.bounds().1.iter().all(|x| x.abs() <= 1.0), "moved to the origin");
            let degenerate = usize::from(found.degenerate_triangle_count > 0);
            assert_eq!(found.warnings.len(), 1 + degenerate, "{:?}", found.warnings);
        }
        let bad = load_text(format!("{near}v 0 nan 0\nv 0 0 1.#INF\nf 1 2 3\nf 1 2 5\n"), &[]);
        assert!(matches!(bad, Err(SceneError::NotFinite { line: 5, .. })));
    }

    #[test]
    fn numbers_that_are_not_finite_are_mended_with_their_lines() {
        for bad in ["-1.#IND00 -1.#IND00 -1.#IND00", "nan nan nan", "0 1.#QNAN 1", "-nan(ind) 0 0", "inf 0 0"]
        {
            let text = format!("{TRIANGLE}vn 1 0 0\nvn {bad}\nvt {bad}\nvt nan 0\nf 1/1/2 2/1/2 3/1/2\n");
            let scene = load_text(text, &[]).unwrap();
            assert_consistent(&scene);
            assert!(scene.normals.iter().all(|n| *n == [0.0, 0.0, 1.0]), "{bad}: {:?}", scene.normals);
            let [texcoord, normal] = [&scene.warnings[1], &scene.warnings[0]];
            assert!(normal.contains("mesh.obj:6: the normal"), "{normal}");
            assert!(texcoord.contains("mesh.obj:7: the texture coordinate"), "{texcoord}");
            assert_eq!(scene.warnings.len(), 2, "the second is not used: {:?}", scene.warnings);
        }
    }

    /// A model of any size is drawn as at usual size, through cameras of a file too.
    #[test]
    fn a_model_of_any_size_is_drawn_alike() {
        let folder = tempfile::tempdir().unwrap();
        let (path, cameras) = (folder.path().join("mesh.obj"), folder.path().join("views.txt"));
        let at_size = |size: f64| {
            let point = |[x, y, z]: [f64; 3]| format!("{:e} {:e} {:e}", x * size, y * size, z * size);
            let corners = [[1.0, 0.0, 0.0], [3.0, 0.0, 1.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]];
            let vertices: String = corners.iter().map(|corner| format!("v {}\n", point(*corner))).collect();
            let texts = (
                format!("{vertices}f 1 2 3 4\nf 1 3 4\n"),
                format!(
                    "scene mesh {}\nat {} {} 60\ndir {} 0 0 -1 50\n",
                    point([1.0, 5.0, 1.0]),
                    point([4.0, 4.0, 4.0]),
                    point([1.0, 1.0, 0.5]),
                    point([1.0, 1.0, 9.0]),
                ),
            );
            std::fs::write(&path, texts.0).unwrap();
            std::fs::write(&cameras, texts.1).unwrap();
            let options = ObjOptions { cameras: Some(cameras.clone()), ..ObjOptions::default() };
            load(&path, &options, &mut Progress::hidden()).unwrap()
        };
        let usual = at_size(1.0);
        assert!(usual.warnings.is_empty() && usual.resize == 1.0);
        for size in [1e-300, 1e-40, 1e-16, 1e-12, 1e-6, 1e8, 1e10, 1e20, 1e39, 1e300] {
            let found = at_size(size);
            assert_consistent(&found);
            let unit = f64::from(found.positions[0][0]);
            let is_alike = |a: &[f32; 3], b: &[f32; 3]| {
                a.iter().zip(b).all(|(a, b)| (f64::from(*a) / unit - f64::from(*b)).abs() < 2e-6)
            };
            assert!(found.positions.iter().zip(&usual.positions).all(|(a, b)| is_alike(a, b)), "{size}");
            assert!(is_alike(&found.light.position, &usual.light.position), "{size}");
            for (a, b) in found.cameras.iter().zip(&usual.cameras) {
                assert!(is_alike(&a.eye, &b.eye), "{size}: {a:?} {b:?}");
                let forward = |camera: &crate::scene::Camera| glam::Vec3::from(camera.frame()[2]);
                assert!(forward(a).distance(forward(b)) < 1e-5, "{size}");
            }
            assert!((found.resize * size / unit - 1.0).abs() < 1e-6 && found.warnings.len() == 1, "{size}");
        }
    }

    /// `wall #3` may be another material, or `wall` with a comment.
    #[test]
    fn names_that_are_equal_only_without_comments_are_warned_of() {
        let mtl = b"newmtl wall #1\nKd 1 0 0\nnewmtl door\nKd 0 1 0\n";
        let with = |name: &str| {
            let text = format!("mtllib a.mtl\n{TRIANGLE}usemtl {name}\nf 1 2 3\n");
            let scene = load_text(text, &[("a.mtl", mtl)]).unwrap();
            (scene.materials[0].albedo, scene.warnings)
        };
        for (name, albedo) in
            [("wall #1", [1.0, 0.0, 0.0]), ("wall", [1.0, 0.0, 0.0]), ("door # oak", [0.0, 1.0, 0.0])]
        {
            assert_eq!(with(name), (albedo, Vec::new()), "{name}");
        }
        let (albedo, warnings) = with("wall #3");
        assert_eq!(albedo, [1.0, 0.0, 0.0]);
        assert!(warnings[0].contains("`wall #3` is not defined; `wall #1` is taken"), "{warnings:?}");
    }

    #[test]
    fn names_of_materials_and_libraries_are_bytes() {
        let mtl = b"newmtl M\xe4\nKd 1 0 0\nnewmtl M\xf6\nKd 0 1 0\n";
        let text = [
            b"mtllib a.mtl # all\n".as_slice(),
            TRIANGLE.as_bytes(),
            b"usemtl M\xe4\nf 1 2 3\nusemtl M\xf6 # other\nf 2 3 4\n",
        ];
        let scene = load_text(text.concat(), &[("a.mtl", mtl)]).unwrap();
        let albedos: Vec<_> =
            scene.triangle_materials.iter().map(|m| scene.materials[*m as usize].albedo).collect();
        assert_eq!(albedos, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        assert_eq!(scene.warnings, Vec::<String>::new());
    }

    #[test]
    fn text_of_16_bits_and_of_old_systems_is_read() {
        let text = format!("mtllib a.mtl\n{TRIANGLE}usemtl h\u{f6}he\nf 1 2 3\n");
        let mtl = "newmtl h\u{f6}he\nKd 1 0 0\n";
        let utf_16 = |text: &str| -> Vec<u8> {
            "\u{feff}".encode_utf16().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect()
        };
        for (obj, mtl) in [
            (utf_16(&text), utf_16(mtl)),
            (utf_16(&text), mtl.as_bytes().to_vec()),
            (text.replace('\n', "\r").into_bytes(), mtl.replace('\n', "\r").into_bytes()),
        ] {
            let scene = load_text(obj, &[("a.mtl", &mtl)]).unwrap();
            assert_eq!((scene.materials[0].albedo, scene.warnings.len()), ([1.0, 0.0, 0.0], 0));
        }
    }

    #[test]
    fn colors_belong_to_their_vertices_and_are_linear() {
        let text = "v 0 0 0 1 0 0\nv 1 0 0 0 0.5 0\nv 0 1 0 0 0 1\nv 1 1 0.5\nf 3 2 1\nf 2 3 4\n";
        let scene = load_text(text, &[]).unwrap();
        assert_consistent(&scene);
        for (position, color) in scene.positions.iter().zip(&scene.colors) {
            let expected = match position {
                [0.0, 0.0, _] => [1.0, 0.0, 0.0],
                [1.0, 0.0, _] => [0.0, 0.214_041_14, 0.0],
                [0.0, 1.0, _] => [0.0, 0.0, 1.0],
                _ => [1.0; 3],
            };
            assert!((0..3).all(|i| (color[i] - expected[i]).abs() < 1e-5), "{position:?}: {color:?}");
        }
        assert_eq!(scene.materials[0].albedo, [1.0; 3], "no material darkens them");
        let plain = load_text("v 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nf 1 2 3\n", &[]).unwrap();
        assert!(plain.colors.is_empty() && plain.materials[0].albedo == [0.6; 3]);
    }

    #[test]
    fn faces_that_cross_themselves_are_named() {
        let text = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 1 -1 0\nf 1 2 3\nf 1 2 3 4\n";
        let scene = load_text(text, &[]).unwrap();
        assert_eq!(scene.triangles.len(), 3);
        assert!(scene.warnings[0].contains("mesh.obj:6: the face crosses itself"), "{:?}", scene.warnings);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn any_mesh_loads_consistently_or_not_at_all(
            vertices in proptest::collection::vec(prop::array::uniform3(-1e3f32..1e3), 3..12),
            faces in proptest::collection::vec(proptest::collection::vec(-12i32..13, 2..6), 1..12),
        ) {
            let mut text = String::new();
            for [x, y, z] in vertices {
                text += &format!("v {x} {y} {z}\n");
            }
            for face in faces {
                let corners: Vec<String> = face.iter().map(|corner| corner.to_string()).collect();
                text += &format!("f {}\n", corners.join(" "));
            }
            if let Ok(scene) = load_text(&text, &[]) {
                assert_consistent(&scene);
            }
        }
    }
}
