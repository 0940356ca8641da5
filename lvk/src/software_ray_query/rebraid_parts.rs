//! The largest parts of a structure, from which rays may start in place of its root.

use std::ops::Range;

use crate::accel::primitive_bounds::Bounds;

/// What is below one node or leaf.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RebraidPart {
    /// The node or leaf; 0 for the whole.
    pub(crate) reference: u32,
    /// Around all of it, in the structure's own space.
    pub(crate) bounds: Bounds,
    /// Numbers of its own parts; none where it is not taken apart.
    pub(crate) below: Range<u32>,
}

/// A structure that no GPU changes: the whole of it, and parts of it, each primitive in one of those of a part.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RebraidParts {
    pub(crate) whole: RebraidPart,
    pub(crate) parts: Vec<RebraidPart>,
}

impl RebraidParts {
    /// A structure that is only taken whole.
    pub(crate) fn single(bounds: Bounds) -> Self {
        Self { whole: RebraidPart { reference: 0, bounds, below: 0..0 }, parts: Vec::new() }
    }

    /// The parts of a part.
    pub(crate) fn children_of(&self, part: &RebraidPart) -> &[RebraidPart] {
        self.parts.get(part.below.start as usize..part.below.end as usize).unwrap_or_default()
    }
}
