//! Makes a mesh of parsed OBJ text: checks, places and divides its faces.

use std::path::Path;

use lvk::readable_name;

use super::SceneError;
use super::key_numbers::KeyNumbers;
use super::mesh::Mesh;
use super::obj_text::{KINDS, NONE, ObjText};
use super::placement::{Extent, Placement};
use super::polygon::{self, Split};
use super::segments::Segments;
use crate::app::progress::Progress;

/// Bounds of the positions that faces with an area use. Warns of texture coordinates and normals that are no numbers, where faces use them.
///
/// # Errors
/// [`SceneError::NotFinite`] for the first such position.
pub(super) fn check(path: &Path, obj: &mut ObjText) -> Result<Extent, SceneError> {
    let mut extent = Extent::new();
    for face in 0..obj.faces.len() {
        add_face(&mut extent, obj, face);
    }
    let flaws = std::mem::take(&mut obj.flaws);
    let used = if flaws.is_empty() { [const { Vec::new() }; 3] } else { used_elements(obj) };
    for flaw in flaws.into_iter().filter(|flaw| used[flaw.kind][flaw.index]) {
        let line = flaw.line;
        let mended = match flaw.kind {
            0 => return Err(SceneError::NotFinite { path: path.into(), line }),
            1 => "0 stands in for it",
            _ => "a normal is computed",
        };
        let path = readable_name(path);
        let what = KINDS[flaw.kind];
        let text = format!("{path}:{line}: the {what} lacks a finite number; {mended}");
        obj.warnings.push(if flaw.kind == 1 { "texture coordinates" } else { "normals" }, text);
    }
    Ok(extent)
}

/// True for each position, texture coordinate and normal that a corner names.
fn used_elements(obj: &ObjText) -> [Vec<bool>; 3] {
    let mut used =
        [obj.positions.len(), obj.texcoords.len(), obj.normals.len()].map(|count| vec![false; count]);
    for corner in obj.corners.range(0..obj.corners.len()) {
        for (used, &index) in used.iter_mut().zip(corner).filter(|(_, index)| **index != NONE) {
            used[index as usize] = true;
        }
    }
    used
}

/// Adds the corners of a face, unless they lie on one line, so that it has no area.
fn add_face(extent: &mut Extent, obj: &ObjText, face: usize) {
    let corners = obj.corners.range(obj.corners_of(face));
    let places = || corners.clone().map(|corner| glam::DVec3::from(obj.positions[corner[0] as usize]));
    let mut edges = places().skip(1).zip(places()).map(|(end, start)| end - start);
    let along = edges.find(|edge| *edge != glam::DVec3::ZERO).map_or(glam::DVec3::ZERO, direction);
    // Within the rounding of numbers with seven digits.
    let has_area = edges.any(|edge| along.cross(direction(edge)).length() > 1e-7);
    if has_area || places().any(|place| !place.is_finite()) {
        places().for_each(|place| extent.add(place.into()));
    }
}

/// The unit vector along an edge of any length, however small or large; zero for none.
fn direction(edge: glam::DVec3) -> glam::DVec3 {
    (edge / edge.abs().max_element()).normalize_or_zero()
}

/// The triangles of the faces in scene units. Corners that agree in everything share a vertex. `colors` are linear; empty, or
/// one for each position. Appends to the warnings of `obj` which faces cross themselves, and empties its lists: their memory is
/// given back while the mesh grows.
pub(super) fn build(
    path: &Path,
    obj: &mut ObjText,
    colors: &[[f32; 3]],
    placement: &Placement,
    progress: &mut Progress,
) -> Result<Mesh, SceneError> {
    let mut builder = Builder::new(obj, colors, placement);
    let mut crossed_lines = Vec::new();
    for face in 0..builder.obj.faces.len() {
        if builder.face(face) {
            crossed_lines.push(builder.obj.faces[face].line);
        }
        if face.is_multiple_of(65_536) {
            builder.release_before(face);
            progress.set(face as u64);
            progress.go_on()?;
        }
    }
    let mesh = builder.finish();
    for line in crossed_lines {
        let path = readable_name(path);
        let text = format!("{path}:{line}: the face crosses itself; it is filled as a fan");
        obj.warnings.push("faces", text);
    }
    Ok(mesh)
}

struct Builder<'a> {
    obj: &'a mut ObjText,
    colors: &'a [[f32; 3]],
    placement: &'a Placement,
    mesh: Mesh,
    /// Position, texture coordinate and normal of each vertex.
    keys: Segments<[u32; 3]>,
    numbers: KeyNumbers,
    /// Vertices of the face.
    vertices: Vec<u32>,
}

impl<'a> Builder<'a> {
    fn new(obj: &'a mut ObjText, colors: &'a [[f32; 3]], placement: &'a Placement) -> Self {
        // Most files name each position, and few have more vertices than positions.
        let vertices = obj.positions.len().min(obj.corners.len());
        let numbers = KeyNumbers::with_capacity(vertices);
        let mesh = Mesh::default();
        Self { obj, colors, placement, mesh, keys: Segments::default(), numbers, vertices: Vec::new() }
    }

    /// Gives back the memory of earlier faces and their corners.
    fn release_before(&mut self, face: usize) {
        self.obj.corners.release_before(self.obj.corners_of(face).start);
        self.obj.faces.release_before(face);
    }

    fn finish(self) -> Mesh {
        let Self { obj, mesh, .. } = self;
        (obj.faces, obj.corners) = Default::default();
        (obj.positions, obj.texcoords, obj.normals) = Default::default();
        mesh
    }

    /// Appends the triangles of a face; true if it crosses itself.
    fn face(&mut self, number: usize) -> bool {
        let range = self.obj.corners_of(number);
        let mut vertices = std::mem::take(&mut self.vertices);
        vertices.clear();
        vertices.extend(range.clone().map(|corner| self.vertex(self.obj.corners[corner])));
        let material = self.obj.faces[number].material;
        let split = match range.len() {
            3 => Split::Fan,
            _ => {
                let place = |corner: &[u32; 3]| self.placement.place(self.obj.positions[corner[0] as usize]);
                polygon::split(&self.obj.corners.range(range).map(place).collect::<Vec<_>>())
            }
        };
        let is_crossed = split == Split::Crossed;
        match split {
            Split::Triangles(triangles) => {
                for triangle in triangles {
                    self.mesh.add_triangle(triangle.map(|corner| vertices[corner]), material);
                }
            }
            Split::Fan | Split::Crossed => {
                for pair in vertices[1..].windows(2) {
                    self.mesh.add_triangle([vertices[0], pair[0], pair[1]], material);
                }
            }
        }
        self.vertices = vertices;
        is_crossed
    }

    fn vertex(&mut self, corner: [u32; 3]) -> u32 {
        let (number, is_new) = self.numbers.number_of(&corner, |number| self.keys[number as usize]);
        if is_new {
            let [position, texcoord, normal] = corner.map(|index| index as usize);
            let placed = self.placement.place(self.obj.positions[position]).map(|x| x as f32);
            let [u, v] = self.obj.texcoords.get(texcoord).copied().unwrap_or_default();
            let normal = self.obj.normals.get(normal).copied().unwrap_or_default();
            self.mesh.colors.extend(self.colors.get(position));
            self.mesh.add_vertex(placed, normal, [u, 1.0 - v]);
            self.keys.push(corner);
        }
        number
    }
}
