//! Memory that the loading of large OBJ files takes. The heap is counted, so this program has one test.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fmt::Write as _;

use lvk_samples::app::progress::Progress;
use lvk_samples::scene::{ObjOptions, Scene};
use peak_alloc::PeakAlloc;

#[global_allocator]
static HEAP: PeakAlloc = PeakAlloc;

/// Quads along an edge of the grid.
const SIDE: u32 = 350;

/// Kinds of elements that corners name, and of faces.
#[derive(Debug, Clone, Copy)]
struct Style {
    /// With texture coordinates and normals.
    is_complete: bool,
    /// Faces of four corners.
    has_quads: bool,
    /// Every third row is glass, which moves behind the opaque triangles.
    has_glass: bool,
    /// Neighbours meet at a right angle, so that all their vertices are doubled.
    has_creases: bool,
}

fn grid(style: Style) -> String {
    let mut text = "mtllib grid.mtl\n".to_owned();
    let places = || (0..=SIDE).flat_map(|row| (0..=SIDE).map(move |column| (row, column)));
    for (row, column) in places() {
        let height = if style.has_creases { column % 2 } else { 0 };
        writeln!(text, "v {column} {height} {row}").unwrap();
    }
    if style.is_complete {
        places().for_each(|(row, column)| writeln!(text, "vt {} {}", column % 7, row % 7).unwrap());
        places().for_each(|(row, column)| writeln!(text, "vn {} 40 {}", column % 9, row % 9).unwrap());
    }
    let corner = |row: u32, column: u32| {
        let number = row * (SIDE + 1) + column + 1;
        if style.is_complete { format!("{number}/{number}/{number}") } else { number.to_string() }
    };
    for row in 0..SIDE {
        let material = if style.has_glass && row % 3 == 0 { "glass" } else { "wall" };
        writeln!(text, "usemtl {material}").unwrap();
        for column in 0..SIDE {
            let [a, b] = [corner(row, column), corner(row, column + 1)];
            let [c, d] = [corner(row + 1, column), corner(row + 1, column + 1)];
            match style.has_quads {
                true => writeln!(text, "f {a} {c} {d} {b}").unwrap(),
                false => writeln!(text, "f {a} {c} {b}\nf {b} {c} {d}").unwrap(),
            }
        }
    }
    text
}

fn data_bytes(scene: &Scene) -> usize {
    size_of_val(&scene.positions[..])
        + size_of_val(&scene.normals[..])
        + size_of_val(&scene.texcoords[..])
        + size_of_val(&scene.colors[..])
        + size_of_val(&scene.triangles[..])
        + size_of_val(&scene.triangle_materials[..])
        + size_of_val(&scene.source_triangles[..])
}

#[test]
fn a_large_file_takes_at_most_three_times_the_memory_of_its_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("grid.obj");
    let materials = "newmtl wall\nKd 0.5 0.5 0.5\nnewmtl glass\nillum 7\nNi 1.5\nd 0.2\nTf 1 1 1\n";
    std::fs::write(folder.path().join("grid.mtl"), materials).unwrap();
    let plain = Style { is_complete: false, has_quads: false, has_glass: false, has_creases: false };
    for style in [
        plain,
        Style { is_complete: true, ..plain },
        Style { has_quads: true, ..plain },
        Style { has_glass: true, ..plain },
        Style { has_creases: true, ..plain },
        Style { is_complete: true, has_quads: true, has_glass: true, has_creases: true },
    ] {
        std::fs::write(&path, grid(style)).unwrap();
        let before = HEAP.current_usage();
        HEAP.reset_peak_usage();
        let scene = Scene::from_obj(&path, &ObjOptions::default(), &mut Progress::hidden()).unwrap();
        let most = HEAP.peak_usage() - before;
        assert_eq!(scene.triangles.len() as u32, 2 * SIDE * SIDE, "{style:?}");
        assert_eq!(
            (scene.opaque_triangle_count as usize) < scene.triangles.len(),
            style.has_glass,
            "{style:?}"
        );
        let doubled = scene.positions.len() as u32 > (SIDE + 1) * (SIDE + 1);
        assert_eq!(doubled, style.has_creases && !style.is_complete, "{style:?}");
        let data = data_bytes(&scene);
        assert!(
            most <= 3 * data,
            "{style:?}: {most} bytes for {data}, {:.2} times",
            most as f64 / data as f64
        );
    }
}
