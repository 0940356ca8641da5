//! The largest parts of a BLAS. A ray can start at a part instead of the root.

use std::ops::Range;

use crate::accel::primitive_bounds::Bounds;

/// The subtree of a node or leaf.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RebraidPart {
    /// Reference to the node or leaf; 0 for the whole BLAS.
    pub(crate) reference: u32,
    /// Bounds of the subtree, in the space of the BLAS.
    pub(crate) bounds: Bounds,
    /// Indices of its own parts; empty if it is not split.
    pub(crate) below: Range<u32>,
}

/// The whole of a BLAS that no GPU changes, and its parts. The parts of a part contain each of its primitives once.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RebraidParts {
    pub(crate) whole: RebraidPart,
    pub(crate) parts: Vec<RebraidPart>,
}

impl RebraidParts {
    /// Returns the parts of a BLAS that is not split.
    pub(crate) fn single(bounds: Bounds) -> Self {
        Self { whole: RebraidPart { reference: 0, bounds, below: 0..0 }, parts: Vec::new() }
    }

    /// Returns the parts of a part.
    pub(crate) fn children_of(&self, part: &RebraidPart) -> &[RebraidPart] {
        self.parts.get(part.below.start as usize..part.below.end as usize).unwrap_or_default()
    }
}
