//! Small procedural meshes.

use std::f32::consts::{PI, TAU};
use std::fmt::Write;

use lvk::glam::Vec3;

/// A triangle mesh. Neighbours in the list are neighbours in space, as drivers that do not sort need.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// Positions of the vertices.
    pub positions: Vec<[f32; 3]>,
    /// Three vertices for each triangle.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Returns a sphere of radius 1 around the origin, `rings` high and twice as many quads around.
    pub fn sphere(rings: u32) -> Self {
        let columns = rings * 2;
        Self::grid(rings, columns, |v, u| {
            let (polar, around) = (v * PI, u * TAU);
            Vec3::new(polar.sin() * around.cos(), polar.cos(), polar.sin() * around.sin())
        })
        .without_slivers()
    }

    /// Returns a torus around the y axis: radius 1, thickness 0.4, `sides` quads around its tube.
    pub fn torus(sides: u32) -> Self {
        Self::grid(sides * 2, sides, |v, u| {
            let (around, tube) = (v * TAU, u * TAU);
            let radius = 1.0 + 0.4 * tube.cos();
            Vec3::new(radius * around.cos(), 0.4 * tube.sin(), radius * around.sin())
        })
    }

    /// Returns hills over the square from -1 to 1 in x and z, `side` quads a side, heights within 0.3.
    pub fn terrain(side: u32) -> Self {
        Self::grid(side, side, |v, u| {
            let (x, z) = (u * 2.0 - 1.0, v * 2.0 - 1.0);
            let height = 0.2 * (x * 3.1 + 0.4).sin() * (z * 2.7).cos() + 0.1 * (x * 7.3 + z * 5.9).sin();
            Vec3::new(x, height, z)
        })
    }

    /// Returns `side`^3 cubes of edge 0.5, one unit apart, centred on the origin.
    pub fn cube_grid(side: u32) -> Self {
        let mut mesh = Self { positions: Vec::new(), triangles: Vec::new() };
        let place = |index: u32| index as f32 - (side as f32 - 1.0) * 0.5;
        for index in 0..side.pow(3) {
            let (x, y, z) = (index % side, index / side % side, index / (side * side));
            mesh.add_cube(Vec3::new(place(x), place(y), place(z)), 0.25);
        }
        mesh
    }

    /// Returns the mesh with three vertices of its own for every triangle.
    pub fn unshared(&self) -> Self {
        let positions = self.triangles.iter().flatten().map(|index| self.positions[*index as usize]);
        let triangles =
            (0..self.triangles.len() as u32).map(|index| [index * 3, index * 3 + 1, index * 3 + 2]);
        Self { positions: positions.collect(), triangles: triangles.collect() }
    }

    /// Returns the text of a Wavefront OBJ file.
    pub fn obj_text(&self) -> String {
        let mut text = String::new();
        for [x, y, z] in &self.positions {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "v {x} {y} {z}");
        }
        for [a, b, c] in self.triangles.iter().map(|triangle| triangle.map(|index| index + 1)) {
            let _ = writeln!(text, "f {a} {b} {c}");
        }
        text
    }

    /// Returns two triangles for each of `rows` by `columns` quads of a surface over the unit square.
    fn grid(rows: u32, columns: u32, surface: impl Fn(f32, f32) -> Vec3) -> Self {
        let width = columns + 1;
        let point = |index: u32| {
            surface((index / width) as f32 / rows as f32, (index % width) as f32 / columns as f32).into()
        };
        let quad = |index: u32| {
            let first = index / columns * width + index % columns;
            [[first, first + 1, first + width], [first + 1, first + width + 1, first + width]]
        };
        Self {
            positions: (0..width * (rows + 1)).map(point).collect(),
            triangles: (0..rows * columns).flat_map(quad).collect(),
        }
    }

    /// Removes triangles of almost no area, as those at the poles of a sphere.
    fn without_slivers(mut self) -> Self {
        let at = |index: u32| Vec3::from(self.positions[index as usize]);
        let area = |[a, b, c]: &[u32; 3]| (at(*b) - at(*a)).cross(at(*c) - at(*a)).length() * 0.5;
        self.triangles = self.triangles.iter().copied().filter(|triangle| area(triangle) > 1e-6).collect();
        self
    }

    fn add_cube(&mut self, center: Vec3, half: f32) {
        const FACES: [[u32; 4]; 6] =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let first = self.positions.len() as u32;
        for corner in 0..8_u32 {
            let side = |bit: u32| if corner & bit == 0 { -half } else { half };
            self.positions.push((center + Vec3::new(side(1), side(2), side(4))).into());
        }
        for [a, b, c, d] in FACES.map(|face| face.map(|corner| first + corner)) {
            self.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
}
