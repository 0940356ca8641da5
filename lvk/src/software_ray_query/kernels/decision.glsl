// Decisions that make a wide tree of a binary one: Ylitie, Karras, Laine, "Efficient Incoherent Ray Traversal on GPUs
// Through Compressed Wide BVHs", HPG 2017. A subtree with the share `n` becomes at most `n + 1` children of a wide node.
const uint kShares = 7u;

// Decisions take three bits for each share, the lowest first: of share 0, the share of the first half if the subtree
// becomes a node, while the second half takes the rest of 6. Of share `n` above, the share of the first half if the
// children of both halves take its place, while the second half takes the rest of `n - 1`; or this if it is as with the
// next lower share.
const uint kAsBelow = 7u;

Quads decisionAt(uint node) {
    return Quads(element(element(job.binary, job.nodeCapacity, 64u), node, 32u));
}

uint decisionOf(uint node) { return decisionAt(node).quad[1].w; }

// Returns the shares of both halves if a subtree with this share is split, else kNone.
uvec2 sharesOf(uint decision, uint share) {
    while (share > 0u && (decision >> share * 3u & 7u) == kAsBelow) share -= 1u;
    uint first = decision >> share * 3u & 7u;
    return share == 0u ? uvec2(kNone) : uvec2(first, share - 1u - first);
}
