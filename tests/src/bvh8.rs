//! A BVH8 blob before a refit: its order and ids are valid, its bounds are not.

/// Number of primitives of a leaf.
const LEAF: usize = 3;
const CHILDREN: usize = 8;
const NODE_WORDS: usize = 20;
const HEADER_WORDS: usize = 32;

/// Returns the words of a BLAS blob of `count` triangles of one geometry, in their own order. Most nodes have nodes,
/// leaves and missing children.
pub fn bvh8_blob(count: usize) -> Vec<u32> {
    let mut nodes: Vec<[u32; NODE_WORDS]> = Vec::new();
    let mut open = std::collections::VecDeque::from([(0, count)]);
    while let Some((first, count)) = open.pop_front() {
        let mut node = [0; NODE_WORDS];
        let own = nodes.len() as u32;
        node[4] = own + 1 + open.len() as u32;
        let (mut taken, mut leaf_slots) = (0, 0);
        for (child, size) in child_sizes(count).into_iter().enumerate() {
            let meta = if size <= LEAF {
                if leaf_slots == 0 {
                    node[5] = (first + taken) as u32;
                }
                leaf_slots += size;
                ((1 << size) - 1) << 5 | (first + taken - node[5] as usize) as u32
            } else {
                open.push_back((first + taken, size));
                node[3] |= 1 << (24 + child);
                0x20 | (24 + child as u32)
            };
            node[6 + child / 4] |= if size == 0 { 0 } else { meta << (child % 4 * 8) };
            taken += size;
        }
        assert_eq!(taken, count, "children have all triangles");
        nodes.push(node);
    }
    assemble(count, &nodes)
}

/// Returns the sizes of a node's children: leaves alone if they hold all triangles, else six nodes and two leaves, as
/// far as there are triangles.
fn child_sizes(count: usize) -> [usize; CHILDREN] {
    let mut left = count;
    let mut take = |size: usize| {
        let size = size.min(left);
        left -= size;
        size
    };
    if count <= LEAF * CHILDREN {
        return [(); CHILDREN].map(|()| take(LEAF));
    }
    let share = (count - 2 * LEAF).div_ceil(CHILDREN - 2);
    std::array::from_fn(|child| take(if child < CHILDREN - 2 { share.min(count) } else { LEAF }))
}

/// Returns the blob of these nodes. The first one is the root.
pub(crate) fn assemble<const WORDS: usize>(count: usize, nodes: &[[u32; WORDS]]) -> Vec<u32> {
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
    words.resize(words.len().next_multiple_of(64), 0);
    words[3] = count as u32;
    words[4] = node_place;
    words[5] = primitives;
    words[8] = nodes.len() as u32;
    words[9] = 1;
    words
}
