// Boxes of the children of wide nodes, encoded so that no box loses anything: Ylitie, Karras, Laine, "Efficient Incoherent
// Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017.

// The smallest power of two by whose 255 steps the extent is covered, as an exponent with its bias.
uint exponentOf(float extent) {
    const float kSlack = 1e-4;
    uint exponent = clamp(floatBitsToUint(extent / 255.0) >> 23, 1u, 253u);
    return ceil(extent / uintBitsToFloat(exponent << 23) + kSlack) > 255.0 ? exponent + 1 : exponent;
}

// The same for each axis. Where a node is much thinner than it is wide, its thickness counts as more, so that rays which run along
// it and touch it take longer to leave the outermost step than to get there. The CPU's nodes are alike (`widen` in wide_tree.rs).
uvec3 exponentsOf(vec3 extent) {
    const uint kThin = 20u, kOfPoint = 87u;
    uvec3 each = uvec3(exponentOf(extent.x), exponentOf(extent.y), exponentOf(extent.z));
    uint most = max(each.x, max(each.y, each.z));
    bool isPoint = all(lessThanEqual(extent, vec3(0)));
    return max(each, uvec3(isPoint ? kOfPoint : max(most, kThin + 1u) - kThin));
}

// Steps from the corner of the node, with what rounding may take away.
uint stepsDown(float distance_, float unit) { return uint(clamp(floor(distance_ / unit - 1e-4), 0.0, 255.0)); }

uint stepsUp(float distance_, float unit) { return uint(clamp(ceil(distance_ / unit + 1e-4), 0.0, 255.0)); }

// Writes the boxes of all children, and answers what they have in common.
Box encode(Words node, Box child[kChildren]) {
    Box all_ = emptyBox();
    [[dont_unroll]] for (uint i = 0; i < kChildren; ++i) all_ = join(all_, child[i]);
    vec3 corner = isEmpty(all_) ? vec3(0) : all_.lo;
    vec3 extent = isEmpty(all_) ? vec3(0) : all_.hi - all_.lo;
    uvec3 exponentOfAxis = exponentsOf(extent);
    uint exponents = 0u;
    [[dont_unroll]] for (uint axis = 0; axis < 3; ++axis) {
        uint exponent = exponentOfAxis[axis];
        float unit = uintBitsToFloat(exponent << 23);
        exponents |= exponent << axis * 8;
        uvec2 low = uvec2(0), high = uvec2(0);
        [[dont_unroll]] for (uint i = 0; i < kChildren; ++i) {
            bool none = isEmpty(child[i]);
            uint down = none ? 255u : stepsDown(child[i].lo[axis] - corner[axis], unit);
            uint up = none ? 0u : stepsUp(child[i].hi[axis] - corner[axis], unit);
            low[i / 4] |= down << (i & 3u) * 8u;
            high[i / 4] |= up << (i & 3u) * 8u;
        }
        uint at = 8 + axis * 4;
        node.word[at] = low.x;
        node.word[at + 1] = low.y;
        node.word[at + 2] = high.x;
        node.word[at + 3] = high.y;
    }
    [[dont_unroll]] for (uint axis = 0; axis < 3; ++axis) node.word[axis] = floatBitsToUint(corner[axis]);
    node.word[3] = exponents | (node.word[3] & 0xff000000u);
    return all_;
}
