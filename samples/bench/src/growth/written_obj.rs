//! OBJ files with any number of triangles.

use std::io::{self, BufWriter, Write};
use std::path::Path;

use super::terrain::{position, side, triangles};

/// What the corners of the faces name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Corners {
    /// Positions. The loader computes normals.
    Positions,
    /// Positions, texture coordinates and normals.
    All,
}

/// Writes the terrain of exactly `count` triangles.
pub(super) fn write(path: &Path, count: u64, corners: Corners) -> io::Result<()> {
    let mut out = BufWriter::with_capacity(1 << 20, std::fs::File::create(path)?);
    let side = side(count);
    let vertices = || (0..=side).flat_map(|row| (0..=side).map(move |column| (row, column)));
    for (row, column) in vertices() {
        let [x, y, z] = position(row, column, side);
        writeln!(out, "v {x:.6} {y:.6} {z:.6}")?;
    }
    if corners == Corners::All {
        for (row, column) in vertices() {
            let [u, v] = [column, row].map(|step| f64::from(step) / f64::from(side));
            writeln!(out, "vt {u:.6} {v:.6}")?;
        }
        for (row, column) in vertices() {
            let [x, _, z] = position(row, column, side);
            writeln!(out, "vn {:.4} 1 {:.4}", -0.9 * (9.0 * x).cos(), 0.7 * (7.0 * z).sin())?;
        }
    }
    for triangle in triangles(count) {
        let [a, b, c] = triangle.map(|vertex| vertex + 1);
        match corners {
            Corners::Positions => writeln!(out, "f {a} {b} {c}")?,
            Corners::All => writeln!(out, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}")?,
        }
    }
    out.flush()
}
