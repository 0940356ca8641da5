//! Vertices that the loader makes: flat normals, and tangents by MikkTSpace.

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::Vec3;

use super::budget::Budget;
use crate::{Positions, Primitive, Problem};

/// Bytes of MikkTSpace for each corner of a triangle, at most.
const MIKKTSPACE_BYTES: u64 = 256;

/// Gives each triangle vertices of its own, with its own normal. Tangents of the file are dropped, as the specification
/// demands.
pub(super) fn make_flat(
    primitive: &mut Primitive,
    budget: &Budget,
    place: &dyn Fn() -> String,
) -> Result<(), Problem> {
    primitive.tangents = Vec::new();
    for target in &mut primitive.morph_targets {
        (target.normals, target.tangents) = (Vec::new(), Vec::new());
    }
    let corners = std::mem::take(&mut primitive.indices);
    select(primitive, &corners, budget, place)?;
    let mut normals = budget.list(corners.len() as u64, place)?;
    for triangle in 0..corners.len() / 3 {
        let corner = |k: usize| Vec3::from(primitive.positions.get(3 * triangle + k).unwrap_or_default());
        let normal = (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalize_or(Vec3::Z);
        normals.extend([normal.to_array(); 3]);
    }
    primitive.normals = normals;
    primitive.indices = corners;
    (0..).zip(&mut primitive.indices).for_each(|(corner, index)| *index = corner);
    Ok(())
}

/// Computes tangents along a set of texture coordinates, which the primitive has. A vertex whose triangles have different
/// tangents becomes several vertices.
pub(super) fn make_tangents(
    primitive: &mut Primitive,
    set: usize,
    budget: &Budget,
    place: &dyn Fn() -> String,
) -> Result<(), Problem> {
    let count = primitive.indices.len() as u64;
    budget.charge(count.saturating_mul(MIKKTSPACE_BYTES), place)?;
    let mut corners = Corners { primitive, set, tangents: budget.list(count, place)? };
    corners.tangents.resize(primitive.indices.len(), None);
    _ = generate_tangents(&mut corners); // its error type has no values
    let tangents = corners.tangents;

    let vertices = primitive.vertex_count();
    let mut split = Split::new(vertices, primitive.indices.len(), budget, place)?;
    for (index, tangent) in primitive.indices.iter_mut().zip(tangents) {
        let normal = Vec3::from(primitive.normals[*index as usize]);
        *index = split.vertex(*index, tangent.unwrap_or_else(|| any_tangent(normal)));
    }
    if split.sources.len() > vertices {
        select(primitive, &split.sources, budget, place)?;
    }
    let normals = primitive.normals.iter().map(|normal| Vec3::from(*normal));
    let filled = split.tangents.into_iter().zip(normals);
    primitive.tangents =
        filled.map(|(tangent, normal)| tangent.unwrap_or_else(|| any_tangent(normal))).collect();
    Ok(())
}

/// Vertices, some of which are copies of others with another tangent.
struct Split {
    /// The vertex that each vertex is a copy of.
    sources: Vec<u32>,
    tangents: Vec<Option<[f32; 4]>>,
    /// The next copy of the same vertex.
    next: Vec<Option<u32>>,
}

impl Split {
    fn new(
        vertices: usize,
        corners: usize,
        budget: &Budget,
        place: &dyn Fn() -> String,
    ) -> Result<Self, Problem> {
        let most = vertices.saturating_add(corners) as u64;
        budget.charge(most.saturating_mul(48), place)?; // the three lists, and the tangents of the result
        let (tangents, next) = (vec![None; vertices], vec![None; vertices]);
        Ok(Self { sources: (0..vertices as u32).collect(), tangents, next })
    }

    /// Returns the copy of a vertex that has this tangent.
    fn vertex(&mut self, vertex: u32, tangent: [f32; 4]) -> u32 {
        let mut copy = vertex as usize;
        loop {
            match self.tangents[copy] {
                None => {
                    self.tangents[copy] = Some(tangent);
                    return copy as u32;
                }
                Some(known) if known == tangent => return copy as u32,
                Some(_) => {}
            }
            match self.next[copy] {
                Some(next) => copy = next as usize,
                None => {
                    self.next[copy] = Some(self.sources.len() as u32);
                    self.sources.push(vertex);
                    self.tangents.push(Some(tangent));
                    self.next.push(None);
                    return (self.sources.len() - 1) as u32;
                }
            }
        }
    }
}

/// The corners of the triangles, for MikkTSpace.
struct Corners<'a> {
    primitive: &'a Primitive,
    set: usize,
    tangents: Vec<Option<[f32; 4]>>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.primitive.indices[3 * face + corner] as usize
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.primitive.triangle_count()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.primitive.positions.get(self.vertex(face, corner)).unwrap_or_default()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.primitive.normals[self.vertex(face, corner)]
    }

    /// The second coordinate points up for MikkTSpace, and down in glTF.
    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        let [u, v] = self.primitive.tex_coords[self.set][self.vertex(face, corner)];
        [u, -v]
    }

    fn set_tangent(&mut self, tangent: Option<TangentSpace>, face: usize, corner: usize) {
        let encoded = tangent.map(|tangent| tangent.tangent_encoded());
        let is_unit = |[x, y, z, _]: &[f32; 4]| (Vec3::new(*x, *y, *z).length() - 1.0).abs() < 1e-2;
        self.tangents[3 * face + corner] = encoded.filter(is_unit);
    }
}

/// Returns a tangent for a normal whose triangles have no area in the texture.
fn any_tangent(normal: Vec3) -> [f32; 4] {
    normal.any_orthonormal_vector().extend(1.0).to_array()
}

/// Replaces the vertices by those at these indices.
fn select(
    primitive: &mut Primitive,
    sources: &[u32],
    budget: &Budget,
    place: &dyn Fn() -> String,
) -> Result<(), Problem> {
    budget.charge(vertex_bytes(primitive).saturating_mul(sources.len() as u64), place)?;
    match &mut primitive.positions {
        Positions::F32(list) => pick(list, sources),
        Positions::Snorm16(list) | Positions::Sint16(list) => pick(list, sources),
        Positions::Unorm16(list) | Positions::Uint16(list) => pick(list, sources),
        Positions::Snorm8(list) | Positions::Sint8(list) => pick(list, sources),
        Positions::Unorm8(list) | Positions::Uint8(list) => pick(list, sources),
    }
    pick(&mut primitive.normals, sources);
    pick(&mut primitive.tangents, sources);
    pick(&mut primitive.colors, sources);
    primitive.tex_coords.iter_mut().for_each(|set| pick(set, sources));
    primitive.joints.iter_mut().for_each(|set| pick(set, sources));
    primitive.weights.iter_mut().for_each(|set| pick(set, sources));
    for target in &mut primitive.morph_targets {
        pick(&mut target.positions, sources);
        pick(&mut target.normals, sources);
        pick(&mut target.tangents, sources);
    }
    Ok(())
}

fn pick<T: Copy>(list: &mut Vec<T>, sources: &[u32]) {
    if !list.is_empty() {
        *list = sources.iter().map(|source| list[*source as usize]).collect();
    }
}

/// Returns the bytes of all attributes of a vertex, at most.
fn vertex_bytes(primitive: &Primitive) -> u64 {
    let sets = 8 * primitive.tex_coords.len() + 8 * primitive.joints.len() + 16 * primitive.weights.len();
    let fixed = primitive.positions.stride_bytes() + 12 + 16 + 16;
    (fixed + sets + 36 * primitive.morph_targets.len()) as u64
}
