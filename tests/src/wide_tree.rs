//! A tree of wide nodes without boxes, as a refit finds it: order, ids and parents are there, places are not.

/// Primitives of a leaf.
const LEAF: usize = 3;
const CHILDREN: usize = 8;
const NODE_WORDS: usize = 20;
const HEADER_WORDS: usize = 32;

/// The words of a structure of `count` triangles of one geometry, in their own order. A node has leaves only where all
/// its triangles fit into them; else it has nodes and, where the triangles run out, nothing.
pub fn wide_structure(count: usize) -> Vec<u32> {
    let mut nodes: Vec<[u32; NODE_WORDS]> = Vec::new();
    let mut parents = Vec::new();
    let mut open = std::collections::VecDeque::from([(0, count, u32::MAX)]);
    let mut reserved = 1;
    while let Some((first, count, parent)) = open.pop_front() {
        let mut node = [0; NODE_WORDS];
        let mut metas = [0_u8; CHILDREN];
        let own = nodes.len() as u32;
        let mut internal = 0;
        node[4] = reserved;
        node[5] = first as u32;
        // Children that would be small become leaves beside nodes.
        let mut taken = 0;
        let share = count.div_ceil(CHILDREN);
        let mut leaf_slots = 0;
        for (child, meta) in metas.iter_mut().enumerate() {
            let wanted = if share > LEAF && child >= 6 { LEAF } else { share.max(LEAF) };
            let remaining_nodes = count - taken;
            let size = if share > LEAF && child == 5 {
                remaining_nodes.saturating_sub(2 * LEAF)
            } else {
                wanted.min(remaining_nodes)
            };
            if size == 0 {
                continue;
            }
            if size <= LEAF {
                let offset = first + taken - node[5] as usize;
                if offset + size > 24 {
                    // Leaves count from the node's first leaf.
                    node[5] = (first + taken - leaf_slots) as u32;
                }
                let offset = first + taken - node[5] as usize;
                *meta = ((1_u8 << size) - 1) << 5 | offset as u8;
                leaf_slots += size;
            } else {
                internal |= 1 << child;
                *meta = 0x20 | (24 + child as u8);
                open.push_back((first + taken, size, own | (child as u32) << 29));
                reserved += 1;
            }
            taken += size;
        }
        assert_eq!(taken, count);
        node[3] = internal << 24;
        node[6] = u32::from_le_bytes([metas[0], metas[1], metas[2], metas[3]]);
        node[7] = u32::from_le_bytes([metas[4], metas[5], metas[6], metas[7]]);
        nodes.push(node);
        parents.push(parent);
    }
    assemble(count, &nodes, &parents)
}

fn assemble(count: usize, nodes: &[[u32; NODE_WORDS]], parents: &[u32]) -> Vec<u32> {
    let mut words = vec![0; HEADER_WORDS];
    let mut add = |part: &mut dyn Iterator<Item = u32>| -> u32 {
        words.resize(words.len().next_multiple_of(4), 0);
        let start = words.len() as u32 / 4;
        words.extend(part);
        start
    };
    let node_place = add(&mut nodes.iter().flatten().copied());
    let triangle = |index: u32| [0, 0, 0, index, 0, 0, 0, 0, 0, 0, 0, 1];
    let primitives = add(&mut (0..count as u32).flat_map(triangle));
    let parents_place = add(&mut parents.iter().copied());
    words.resize(words.len().next_multiple_of(64), 0);
    words[3] = count as u32;
    words[4] = node_place;
    words[5] = primitives;
    words[8] = nodes.len() as u32;
    words[9] = 1;
    words[10] = parents_place;
    words
}
