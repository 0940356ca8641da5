//! Triangles that name vertices instead of holding them, for structures that take little memory.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use glam::Vec3;

use crate::accel::software::layout::{LeafIndexed, LeafTriangle};
use crate::barrier::IdHasher;

/// Triangles and the vertices they name, each position once.
pub(super) struct Indexed {
    pub(super) triangles: Vec<LeafIndexed>,
    pub(super) vertices: Vec<Vec3>,
}

/// Most geometries whose numbers fit beside those of primitives.
const MOST_GEOMETRIES: usize = 1 << 8;
/// Most primitives of a geometry beside its number.
const MOST_PRIMITIVES: u32 = 1 << 24;

/// The triangles in this order; `None` where their numbers do not fit.
pub(super) fn indexed(triangles: &[LeafTriangle], order: &[u32], geometries: usize) -> Option<Indexed> {
    let several = geometries > 1;
    if several && (geometries > MOST_GEOMETRIES || triangles.iter().any(|of| of.primitive >= MOST_PRIMITIVES))
    {
        return None;
    }
    let mut places: HashMap<[u32; 3], u32, BuildHasherDefault<IdHasher>> = HashMap::default();
    let mut vertices = Vec::new();
    let mut place = |position: Vec3| {
        let bits = position.to_array().map(f32::to_bits);
        *places.entry(bits).or_insert_with(|| {
            vertices.push(position);
            vertices.len() as u32 - 1
        })
    };
    let leaf = |number: &u32| {
        let of = &triangles[*number as usize];
        let geometry = if several { of.geometry << 24 } else { 0 };
        LeafIndexed { vertices: [of.a, of.b, of.c].map(&mut place), primitive: of.primitive | geometry }
    };
    let triangles = order.iter().map(leaf).collect();
    Some(Indexed { triangles, vertices })
}
