//! Chooses the node format of a tree over the primitives of a mesh.

use super::bvh2;
use super::bvh8;
use super::nodes::{Bvh, BvhNodes};
use super::phase_times::PhaseTimes;
use crate::accel::primitive_bounds::Bounds;
use crate::cpu_scope::cpu_scope;
use crate::software_ray_query::layout::{NONE, leaf};

impl Bvh {
    /// Builds the tree of a BLAS: wide, except for meshes that wide nodes do not suit.
    ///
    /// The bounds are freed as soon as the build has read them. `again` returns them a second time, for the few meshes that
    /// need it.
    pub(crate) fn build(
        bounds: Vec<Bounds>,
        again: impl FnOnce() -> Vec<Bounds>,
        times: &mut PhaseTimes,
    ) -> Self {
        cpu_scope!("build BVH on the CPU");
        const ONE_LEAF: usize = 3;
        match bounds.len() {
            0 => Self { nodes: BvhNodes::Wide(Vec::new()), root: NONE, order: Vec::new() },
            count @ 1..=ONE_LEAF => {
                let order = (0..count as u32).collect();
                Self { nodes: BvhNodes::Wide(Vec::new()), root: leaf(0, count), order }
            }
            _ => bvh8::build_bvh8(bounds, times).unwrap_or_else(|| bvh2::build_bvh2(&again(), ONE_LEAF)),
        }
    }
}
