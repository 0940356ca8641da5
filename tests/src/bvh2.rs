//! A BVH2 blob before a refit: its order and ids are valid, its bounds are not.

use crate::bvh8::assemble;

/// Number of primitives of a leaf.
const LEAF: usize = 3;
const NODE_WORDS: usize = 16;

/// Returns the words of a BLAS blob of `count` triangles of one geometry, at least one, in their own order.
pub fn bvh2_blob(count: usize) -> Vec<u32> {
    let mut nodes = Vec::new();
    let root = append_subtree(0, count, &mut nodes);
    let mut words = assemble(count, &nodes);
    (words[0], words[2]) = (1, root);
    words
}

/// Appends the nodes of a range of triangles, and returns the reference to their root or leaf.
fn append_subtree(first: usize, count: usize, nodes: &mut Vec<[u32; NODE_WORDS]>) -> u32 {
    if count <= LEAF {
        return 1 << 31 | (count as u32 - 1) << 27 | first as u32;
    }
    let own = nodes.len();
    nodes.push([0; NODE_WORDS]);
    let left = count / 3;
    nodes[own][3] = append_subtree(first, left, nodes);
    nodes[own][7] = append_subtree(first + left, count - left, nodes);
    own as u32
}
