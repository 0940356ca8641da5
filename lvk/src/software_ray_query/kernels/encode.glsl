// Encodes the bounds of the children of wide nodes conservatively: Ylitie, Karras, Laine, "Efficient Incoherent Ray
// Traversal on GPUs Through Compressed Wide BVHs", HPG 2017.

// Returns the smallest power of two whose 255 steps cover the extent, as a biased exponent.
uint exponentOf(float extent) {
    const float kSlack = 1e-4;
    uint exponent = clamp(floatBitsToUint(extent / 255.0) >> 23, 1u, 253u);
    return ceil(extent / uintBitsToFloat(exponent << 23) + kSlack) > 255.0 ? exponent + 1 : exponent;
}

// Returns the exponents of all axes. If a node is much thinner than it is wide, its thickness is increased. Rays that
// run along the node and touch it then take longer to leave the outermost step than to reach it. See `widen_thin_node`
// in bvh/bvh8.rs.
uvec3 exponentsOf(vec3 extent) {
    const uint kThin = 20u, kOfPoint = 87u;
    uvec3 each = uvec3(exponentOf(extent.x), exponentOf(extent.y), exponentOf(extent.z));
    uint most = max(each.x, max(each.y, each.z));
    bool isPoint = all(lessThanEqual(extent, vec3(0)));
    return max(each, uvec3(isPoint ? kOfPoint : max(most, kThin + 1u) - kThin));
}

// Returns the steps from the node's minimum, with a margin for rounding.
uint stepsDown(float distance_, float unit) { return uint(clamp(floor(distance_ / unit - 1e-4), 0.0, 255.0)); }

uint stepsUp(float distance_, float unit) { return uint(clamp(ceil(distance_ / unit + 1e-4), 0.0, 255.0)); }

// Writes the bounds of all children, and returns their union.
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
