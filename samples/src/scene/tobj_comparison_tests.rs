//! Compares the readers of OBJ and MTL with the crate `tobj`, on text that `tobj` reads without loss.

use std::fmt::Write as _;
use std::path::Path;

use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;

use super::mtl_text::{self, MtlEntry};
use super::obj_text::{self, NONE, ObjText};
use crate::app::progress::Progress;

/// Names of the materials that every generated library defines.
const NAMES: [&str; 4] = ["wall", "a wall", "Wall.001", "wall:2"];

/// Elements, and faces behind them that use any element so far.
#[derive(Debug, Clone)]
struct Part {
    positions: Vec<[f32; 3]>,
    texcoords: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
    /// Number of the material from here on; as before if `None`.
    material: Option<usize>,
    /// Numbers of the elements of each corner, to be taken modulo their count; true for relative indices.
    faces: Vec<(Vec<[usize; 3]>, bool)>,
}

/// Spelling of numbers and lines.
#[derive(Debug, Clone, Copy)]
struct Style {
    is_scientific: bool,
    line_end: &'static str,
    blank: &'static str,
    /// Positions have colours.
    is_colored: bool,
    /// Corners have texture coordinates, normals. `tobj` takes the first of a file for corners without.
    has: [bool; 2],
}

impl Style {
    fn numbers(self, values: &[f32]) -> String {
        let word = |value: &f32| match self.is_scientific {
            true => format!("{}{value:e}", self.blank),
            false => format!("{}{value}", self.blank),
        };
        values.iter().map(word).collect()
    }
}

fn style() -> impl Strategy<Value = Style> {
    let ends = prop::sample::select(&["\n", "\r\n"][..]);
    let blanks = prop::sample::select(&[" ", "  ", "\t"][..]);
    let flags = prop::array::uniform4(any::<bool>());
    (ends, blanks, flags).prop_map(|(line_end, blank, [is_scientific, is_colored, texcoords, normals])| {
        Style { is_scientific, line_end, blank, is_colored, has: [texcoords, normals] }
    })
}

fn part() -> impl Strategy<Value = Part> {
    let coordinate = || -1e3f32..1e3;
    // Eighths have the same length in single and double precision.
    let eighths = (-8..=8i8, -8..=8i8, 1..=8i8).prop_map(|(x, y, z)| [x, y, z].map(|n| f32::from(n) / 8.0));
    let elements = (
        vec(prop::array::uniform3(coordinate()), 1..6),
        vec(prop::array::uniform2(-2f32..2.0), 1..4),
        vec(eighths, 1..4),
    );
    let faces = vec((vec(prop::array::uniform3(0..1_000usize), 3..7), any::<bool>()), 0..6);
    let rest = (option::of(0..NAMES.len()), faces);
    (elements, rest).prop_map(|((positions, texcoords, normals), (material, faces))| Part {
        positions,
        texcoords,
        normals,
        material,
        faces,
    })
}

fn obj_text(parts: &[Part], style: Style) -> String {
    let Style { line_end: end, blank, is_colored, .. } = style;
    let mut text = format!("# made by a test{end}mtllib a.mtl{end}");
    let mut counts = [0usize; 3];
    for (number, part) in parts.iter().enumerate() {
        text.push_str(&format!("{end}g part{number}{end}s off{end}"));
        for (i, position) in part.positions.iter().enumerate() {
            let color =
                if is_colored { style.numbers(&[0.25, 0.5, i as f32 * 0.125]) } else { String::new() };
            text.push_str(&format!("v{}{color}{end}", style.numbers(position)));
        }
        part.texcoords
            .iter()
            .filter(|_| style.has[0])
            .for_each(|t| text.push_str(&format!("vt{}{end}", style.numbers(t))));
        part.normals
            .iter()
            .filter(|_| style.has[1])
            .for_each(|n| text.push_str(&format!("vn{}{end}", style.numbers(n))));
        let added = [part.positions.len(), part.texcoords.len(), part.normals.len()];
        counts.iter_mut().zip(added).for_each(|(count, added)| *count += added);
        if let Some(material) = part.material {
            text.push_str(&format!("usemtl {}{end}", NAMES[material]));
        }
        for (corners, is_relative) in &part.faces {
            let index = |pick: usize, kind: usize| match is_relative {
                true => -((pick % counts[kind]) as i64) - 1,
                false => (pick % counts[kind]) as i64 + 1,
            };
            let word = |&[p, t, n]: &[usize; 3]| match style.has {
                [true, true] => format!("{blank}{}/{}/{}", index(p, 0), index(t, 1), index(n, 2)),
                [true, false] => format!("{blank}{}/{}", index(p, 0), index(t, 1)),
                [false, true] => format!("{blank}{}//{}", index(p, 0), index(n, 2)),
                [false, false] => format!("{blank}{}", index(p, 0)),
            };
            let words: String = corners.iter().map(word).collect();
            text.push_str(&format!("f{words}{end}"));
        }
    }
    text
}

/// A face with the values of its corners in place of their numbers.
#[derive(Debug, PartialEq)]
struct PlainFace {
    material: Option<String>,
    positions: Vec<[f32; 3]>,
    colors: Vec<[f32; 3]>,
    texcoords: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
}

fn our_faces(obj: &ObjText) -> Vec<PlainFace> {
    let face = |number: usize| {
        let face = obj.faces[number];
        let corners = obj.corners.range(obj.corners_of(number));
        let used = |kind: usize| {
            corners.clone().map(move |corner| corner[kind]).filter(|i| *i != NONE).map(|i| i as usize)
        };
        PlainFace {
            material: obj.materials[face.material as usize]
                .clone()
                .map(|name| String::from_utf8(name).unwrap()),
            positions: used(0).map(|i| obj.positions[i].map(|x| x as f32)).collect(),
            colors: used(0).filter_map(|i| obj.colors.get(i).copied()).collect(),
            texcoords: used(1).map(|i| obj.texcoords[i]).collect(),
            normals: used(2).map(|i| obj.normals[i]).collect(),
        }
    };
    (0..obj.faces.len()).map(face).collect()
}

fn their_faces(text: &str) -> Vec<PlainFace> {
    let library = NAMES.map(|name| tobj::Material { name: name.into(), ..Default::default() });
    let load = |_: &Path| {
        let numbers = NAMES.iter().enumerate().map(|(number, name)| ((*name).to_owned(), number)).collect();
        Ok((library.to_vec(), numbers))
    };
    let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &tobj::LoadOptions::default(), load).unwrap();
    models.iter().flat_map(|model| their_faces_of(&model.mesh)).collect()
}

fn their_faces_of(mesh: &tobj::Mesh) -> Vec<PlainFace> {
    fn picked<const N: usize>(values: &[f32], indices: Option<&[u32]>) -> Vec<[f32; N]> {
        let all = values.as_chunks::<N>().0;
        indices.unwrap_or_default().iter().map(|index| all[*index as usize]).collect()
    }
    let triangles = vec![3; mesh.indices.len() / 3];
    let arities = if mesh.face_arities.is_empty() { &triangles } else { &mesh.face_arities };
    let mut start = 0;
    let face = |arity: &u32| {
        let range = start..start + *arity as usize;
        start = range.end;
        let indices = &mesh.indices[range.clone()];
        let colored = (!mesh.vertex_color.is_empty()).then_some(indices);
        let normals = picked::<3>(&mesh.normals, mesh.normal_indices.get(range.clone()));
        PlainFace {
            material: mesh.material_id.map(|number| NAMES[number].to_owned()),
            positions: picked(&mesh.positions, Some(indices)),
            colors: picked(&mesh.vertex_color, colored),
            texcoords: picked(&mesh.texcoords, mesh.texcoord_indices.get(range)),
            normals: normals
                .into_iter()
                .map(|n| glam::DVec3::from(n.map(f64::from)).normalize_or_zero().as_vec3().to_array())
                .collect(),
        }
    };
    arities.iter().map(face).collect()
}

/// A material as text: its statements in any order, each at most once.
fn material_lines() -> impl Strategy<Value = Vec<String>> {
    let unit = || 0f32..=1.0;
    let color = || prop::array::uniform3(unit());
    let map = || "[A-Za-z][A-Za-z0-9_.() -]{0,8}[a-z0-9]\\.(png|jpg|TGA)";
    let colors = (option::of(color()), option::of(color()), option::of(color()), option::of(color()));
    let numbers = (option::of(0f32..1e4), option::of(1f32..3.0), option::of(unit()), option::of(0..11u8));
    let maps = (option::of(map()), option::of(map()), option::of(map()));
    let lines =
        (colors, numbers, maps).prop_map(|((kd, ks, ke, ka), (ns, ni, d, illum), (kd_map, d_map, bump))| {
            let color = |keyword: &str, [r, g, b]: [f32; 3]| format!("{keyword} {r} {g} {b}");
            [
                kd.map(|value| color("Kd", value)),
                ks.map(|value| color("Ks", value)),
                ke.map(|value| color("Ke", value)),
                ka.map(|value| color("Ka", value)),
                ns.map(|value| format!("Ns {value}")),
                ni.map(|value| format!("Ni {value:e}")),
                d.map(|value| format!("d {value:.6}")),
                illum.map(|value| format!("illum {value}")),
                kd_map.map(|name| format!("map_Kd {name}")),
                d_map.map(|name| format!("map_d {name}")),
                bump.map(|name| format!("map_Bump {name}")),
            ]
            .into_iter()
            .flatten()
            .collect::<Vec<String>>()
        });
    lines.prop_shuffle()
}

fn our_materials(text: &str) -> Vec<MtlEntry> {
    let (entries, flawed_lines) = mtl_text::parse(text.as_bytes());
    assert_eq!(flawed_lines, [0; 0]);
    entries
}

fn their_materials(text: &str) -> Vec<MtlEntry> {
    let (materials, _) = tobj::load_mtl_buf(&mut text.as_bytes()).unwrap();
    let bytes = |name: Option<String>| name.map(String::into_bytes);
    let entry = |material: tobj::Material| MtlEntry {
        name: material.name.into_bytes(),
        diffuse: material.diffuse,
        specular: material.specular,
        emissive: material.emissive,
        shininess: material.shininess,
        optical_density: material.optical_density,
        dissolve: material.dissolve,
        illumination: material.illumination_model,
        diffuse_map: bytes(material.diffuse_texture),
        dissolve_map: bytes(material.dissolve_texture),
        relief_map: bytes(material.normal_texture),
        ..MtlEntry::default()
    };
    materials.into_iter().map(entry).collect()
}

proptest! {
    #[test]
    fn obj_text_means_the_same_to_both(parts in vec(part(), 1..6), style in style()) {
        let text = obj_text(&parts, style);
        let face_count: usize = parts.iter().map(|part| part.faces.len()).sum();
        let obj = obj_text::parse(Path::new("a.obj"), text.as_bytes(), &mut Progress::hidden());
        // Text without faces is refused.
        prop_assert_eq!(obj.is_ok(), face_count > 0);
        let ours = obj.map(|obj| our_faces(&obj)).unwrap_or_default();
        prop_assert_eq!(ours.len(), face_count);
        prop_assert_eq!(ours, their_faces(&text));
    }

    #[test]
    fn mtl_text_means_the_same_to_both(
        materials in vec(material_lines(), 1..=NAMES.len()),
        end in prop::sample::select(&["\n", "\r\n"][..]),
    ) {
        let mut text = format!("# made by a test{end}");
        for (name, lines) in NAMES.iter().zip(&materials) {
            write!(text, "{end}newmtl {name}{end}").unwrap();
            lines.iter().for_each(|line| write!(text, "\t{line}{end}").unwrap());
        }
        prop_assert_eq!(our_materials(&text), their_materials(&text));
    }
}
