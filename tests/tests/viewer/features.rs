//! Features of glTF whose picture is that of the same model written without them, and the table of features in `docs/samples.md`.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use glam::{Mat4, Quat, Vec3};
use lvk::Context;
use lvk_gltf::{
    ImageData, Material, MipLevel, Model, Node, Positions, TexelFormat, TextureRef, TextureTransform,
    Transform, Trs,
};
use lvk_samples::hybrid::RayPath;
use lvk_samples::scene::Camera;
use lvk_tests::rtx_sample::software_device;
use lvk_viewer::light::{Environment, SunSetting};

use crate::paths::assert_alike;
use crate::scenes::{Builder, View, colored, matte, radiance};

/// The path tracer's picture of a model of about the size of 2.
fn shown(ctx: &Context, model: &Model) -> Vec<[f32; 3]> {
    let camera = Camera::looking_at([1.5, 1.7, 4.0], [0.0, 0.3, 0.0], 40.0);
    let view = View { camera, size: [60, 40], samples: 8 };
    radiance(ctx, RayPath::Query, model, &Environment::day(&SunSetting::default()), &view)
}

fn ground() -> Builder {
    Builder::default().quad(
        Vec3::new(-3.0, -0.5, 3.0),
        Vec3::X * 6.0,
        Vec3::NEG_Z * 6.0,
        colored([0.6, 0.5, 0.4], 0.0, 0.8),
    )
}

/// A block whose corners are whole steps of 16 bits.
fn block(builder: Builder) -> Builder {
    let half = 16_384.0 / 32_767.0;
    builder.cuboid(Vec3::splat(-half), Vec3::splat(half), &colored([0.3, 0.5, 0.8], 0.0, 0.4))
}

#[test]
fn quantised_positions_are_where_floats_are() {
    let Some(ctx) = software_device() else { return };
    let floats = block(ground()).model();
    let mut quantised = floats.clone();
    let encoded = |value: f32| (value * 32_767.0).round() as i16;
    for mesh in &mut quantised.meshes[1..] {
        let Positions::F32(positions) = &mesh.primitives[0].positions else { panic!("not floats") };
        let encoded = positions.iter().map(|[x, y, z]| [encoded(*x), encoded(*y), encoded(*z), 0]).collect();
        mesh.primitives[0].positions = Positions::Snorm16(encoded);
    }
    assert_alike("quantised", &shown(&ctx, &floats), &shown(&ctx, &quantised));
}

#[test]
fn instances_of_a_node_are_where_nodes_of_their_own_are() {
    let Some(ctx) = software_device() else { return };
    let places: Vec<Trs> = (0..3_u8)
        .map(|number| Trs {
            translation: Vec3::new(f32::from(number) - 1.0, 0.2 * f32::from(number), 0.0),
            rotation: Quat::from_rotation_y(0.4 * f32::from(number)),
            scale: Vec3::new(0.5, 0.4 + 0.2 * f32::from(number), 0.5),
        })
        .collect();
    let moved = Mat4::from_translation(Vec3::new(0.1, 0.0, -0.2));
    let model = block(ground()).model();
    let (mut instanced, mut nodes) = (model.clone(), model.clone());
    for node in 1..model.nodes.len() {
        instanced.nodes[node].instances = Some(places.clone());
        instanced.nodes[node].transform = Transform::Matrix(moved);
        nodes.nodes[node].transform = Transform::Matrix(moved * places[0].matrix());
        for place in &places[1..] {
            let transform = Transform::Matrix(moved * place.matrix());
            nodes.scenes[0].roots.push(nodes.nodes.len());
            nodes.nodes.push(Node { mesh: model.nodes[node].mesh, transform, ..Node::default() });
        }
    }
    assert_alike("instances", &shown(&ctx, &nodes), &shown(&ctx, &instanced));
}

/// A texture of four colours that is turned, scaled and moved shows what it shows by coordinates that are.
#[test]
fn transforms_of_textures_are_those_of_coordinates() {
    let Some(ctx) = software_device() else { return };
    let bytes = [[255, 40, 40, 255], [40, 255, 40, 255], [40, 40, 255, 255], [250, 250, 250, 255]].concat();
    let data = Arc::new(ImageData {
        format: TexelFormat::Rgba8,
        mips: vec![MipLevel { width: 2, height: 2, bytes }],
    });
    let transform = TextureTransform { offset: [0.3, -0.2], rotation: 0.6, scale: [3.0, 2.0] };
    let textured = |transform| {
        let texture = TextureRef { image: 0, sampler: 0, tex_coord: 0, transform };
        let material = Material { base_color_texture: Some(texture), ..matte([1.0; 3]) };
        Builder::default()
            .quad(Vec3::new(-2.0, -0.5, 2.0), Vec3::X * 4.0, Vec3::NEG_Z * 4.0, material)
            .image(&data)
            .model()
    };
    let by_texture = textured(Some(transform));
    let mut by_coordinates = textured(None);
    for coordinates in &mut by_coordinates.meshes[0].primitives[0].tex_coords[0] {
        *coordinates = transform.apply(*coordinates);
    }
    assert_alike("a transform", &shown(&ctx, &by_coordinates), &shown(&ctx, &by_texture));
    let plain = shown(&ctx, &textured(None));
    assert_ne!(plain, shown(&ctx, &by_texture), "the transform does something");
}

const DOCUMENT: &str = include_str!("../../../docs/samples.md");

/// The cells of the table of features: the first and the last of each row.
fn rows() -> Vec<(&'static str, &'static str)> {
    let lines = DOCUMENT.lines().skip_while(|line| !line.starts_with("| Feature | Path tracer |"));
    let cells = lines.take_while(|line| line.starts_with('|')).map(|line| {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        (cells[1], cells[cells.len() - 2])
    });
    cells.skip(2).collect()
}

/// The modules of this program, and `module::test` of each of its tests.
fn names() -> BTreeSet<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/viewer");
    let mut names = BTreeSet::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let module = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let Ok(text) = std::fs::read_to_string(&path) else { continue };
        for test in text.split("#[test]\n").skip(1) {
            let name = test.split("fn ").nth(1).and_then(|rest| rest.split('(').next()).unwrap();
            names.insert(format!("{module}::{name}"));
            names.insert(module.clone());
        }
    }
    names
}

/// Warnings are of a module's own tests: those of materials and cameras that the viewer cannot show.
const UNIT_TESTS: (&str, &str) = ("gpu::ignored", include_str!("../../../samples/viewer/src/gpu/ignored.rs"));

#[test]
fn every_row_of_the_table_of_features_names_its_tests() {
    let (rows, names) = (rows(), names());
    assert!(rows.len() >= 20, "{} rows", rows.len());
    for (feature, tests) in rows {
        for test in tests.split(", ").map(|test| test.trim_matches('`')) {
            let is_unit_test = test == UNIT_TESTS.0 && UNIT_TESTS.1.contains("#[test]");
            assert!(names.contains(test) || is_unit_test, "{feature}: no test is named {test}");
        }
    }
}
