//! Loads a Wavefront OBJ file: clean the text, parse, put together, mend normals, arrange, light and frame.

use std::io::{BufRead, Read};
use std::path::Path;

use super::mesh::Mesh;
use super::mtl::{Library, Selection};
use super::obj_text::{CleanObj, clean};
use super::setting::Setting;
use super::{Material, ObjOptions, Scene, SceneError, benchmark, camera_file, normals};
use crate::app::input_file::{self, FileKind};
use crate::app::progress::Progress;

/// Implements [`Scene::from_obj`].
pub(super) fn load(path: &Path, options: &ObjOptions, progress: &mut Progress) -> Result<Scene, SceneError> {
    let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    if let Some(scale) = options.scale.filter(|scale| !(scale.is_finite() && *scale > 0.0)) {
        return Err(SceneError::BadScale { scale });
    }
    let mut own_views = options.cameras.as_ref().map(|file| camera_file::read(file, &name)).transpose()?;
    let mut obj = read_clean(path, &name, progress)?;
    let benchmark = benchmark::find(&name, obj.triangle_count);
    let scale = options.scale.or(benchmark.as_ref().map(|known| known.scale)).unwrap_or(1.0);
    own_views.iter_mut().for_each(|views| views.move_by(obj.origin.map(|x| -x * f64::from(scale))));
    let views = own_views.or(benchmark.map(|known| known.views));
    let library = Library::read(path, &obj.libraries);
    let library = if options.normal_maps { library.with_normal_maps() } else { library };
    let mut mesh = parse(path, &obj, scale, &format!("{name}: parsing"), progress)?;
    let degenerate = mesh.drop_degenerate();
    if mesh.triangles.is_empty() {
        return Err(SceneError::Empty { path: path.into(), degenerate });
    }
    let names = names_in_use(&mut mesh, &obj.materials);
    progress.stage(&format!("{name}: textures"), 0);
    let Selection { materials, textures, normal_maps, warnings } = library.select(&names);
    obj.warnings.extend(warnings);
    progress.go_on()?;
    progress.stage(&format!("{name}: arranging triangles"), 0);
    let opaque_triangle_count = finish(&mut mesh, &materials, &mut obj.warnings, degenerate);
    let setting = Setting::from_mesh(&mesh, views);
    Ok(Scene {
        opaque_triangle_count,
        textures,
        normal_maps,
        degenerate_triangle_count: degenerate as u32,
        warnings: obj.warnings,
        ..setting.into_scene(name, mesh, materials)
    })
}

fn read_clean(path: &Path, name: &str, progress: &mut Progress) -> Result<CleanObj, SceneError> {
    let content = input_file::read_named_by_user(path, FileKind::Obj)
        .map_err(|source| SceneError::from_io(path, source))?;
    progress.stage(&format!("{name}: reading"), content.len() as u64);
    clean(path, &content, progress)
}

/// Parses the cleaned text. Material numbers are those of [`CleanObj::materials`].
fn parse(
    path: &Path,
    obj: &CleanObj,
    scale: f32,
    stage: &str,
    progress: &mut Progress,
) -> Result<Mesh, SceneError> {
    let options = tobj::LoadOptions { single_index: true, triangulate: true, ..Default::default() };
    progress.stage(stage, obj.text.len() as u64);
    let mut reader = Watched { rest: obj.text.as_bytes(), total: obj.text.len(), progress };
    let parsed = tobj::load_obj_buf(&mut reader, &options, |_| numbered(obj.materials.len()))
        .map_err(|source| SceneError::Parse { path: path.into(), source });
    reader.progress.go_on()?;
    let (models, _) = parsed?;
    let mut mesh = Mesh::default();
    for model in &models {
        append(&mut mesh, &model.mesh, scale);
    }
    match mesh.positions.iter().flatten().all(|x| x.is_finite()) {
        true => Ok(mesh),
        false => Err(SceneError::BadScale { scale }),
    }
}

/// Materials named `0`, `1`, ... as the cleaned text names them; only their numbers matter to the parser.
fn numbered(count: usize) -> tobj::MTLLoadResult {
    let materials = vec![tobj::Material::default(); count];
    Ok((materials, (0..count).map(|number| (number.to_string(), number)).collect()))
}

fn append(mesh: &mut Mesh, part: &tobj::Mesh, scale: f32) {
    let first = mesh.positions.len() as u32;
    let positions = part.positions.as_chunks::<3>().0;
    let normals = part.normals.as_chunks::<3>().0;
    let texcoords = part.texcoords.as_chunks::<2>().0;
    for ((position, normal), texcoord) in positions.iter().zip(normals).zip(texcoords) {
        mesh.add_vertex(position.map(|x| x * scale), *normal, [texcoord[0], 1.0 - texcoord[1]]);
    }
    let material = part.material_id.unwrap_or_default() as u32;
    for triangle in part.indices.as_chunks::<3>().0 {
        mesh.add_triangle(triangle.map(|i| first + i), material);
    }
}

/// Renumbers the materials so that only used ones are left; returns their names.
fn names_in_use(mesh: &mut Mesh, names: &[Option<String>]) -> Vec<Option<String>> {
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

fn finish(mesh: &mut Mesh, materials: &[Material], warnings: &mut Vec<String>, degenerate: usize) -> u32 {
    if degenerate > 0 {
        warnings.push(format!("{degenerate} triangles without area were left out"));
    }
    normals::complete(mesh);
    mesh.arrange(materials)
}

/// A reader that reports its progress, and fails once the load is cancelled.
struct Watched<'a> {
    rest: &'a [u8],
    total: usize,
    progress: &'a mut Progress,
}

impl Read for Watched<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.fill_buf()?.read(buffer)?;
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for Watched<'_> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        const BLOCK: usize = 1 << 16;
        self.progress.go_on().map_err(std::io::Error::other)?;
        Ok(&self.rest[..self.rest.len().min(BLOCK)])
    }

    fn consume(&mut self, count: usize) {
        const STEP: usize = 1 << 20;
        let before = self.rest.len() / STEP;
        self.rest = self.rest.get(count..).unwrap_or_default();
        if self.rest.len() / STEP != before {
            self.progress.set((self.total - self.rest.len()) as u64);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Loads `text` from a folder that also holds `files`.
    fn load_text(text: &str, files: &[(&str, &[u8])]) -> Result<Scene, SceneError> {
        let folder = tempfile::tempdir().unwrap();
        for (name, content) in files {
            std::fs::write(folder.path().join(name), content).unwrap();
        }
        let path = folder.path().join("mesh.obj");
        std::fs::write(&path, text).unwrap();
        load(&path, &ObjOptions::default(), &mut Progress::hidden())
    }

    const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n";

    fn assert_consistent(scene: &Scene) {
        let vertex_count = scene.positions.len();
        assert_eq!(scene.normals.len(), vertex_count);
        assert_eq!(scene.texcoords.len(), vertex_count);
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
        let scene = load_text(&format!("{TRIANGLE}f 1 2 4 3\nf 1 2 3\n"), &[]).unwrap();
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
        let scene = load_text(&format!("{TRIANGLE}vt 0.25 1\nf 1/1 2/1 3/1\n"), &[]).unwrap();
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
