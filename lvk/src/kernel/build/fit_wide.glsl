// Fits the boxes of wide nodes, bottom up, and encodes them anew so that no box loses anything: Ylitie, Karras, Laine,
// "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017. What is below each child stays.
const uint kChildren = 8u;

uint byteOf(Words node, uint word, uint child) { return node.word[word + child / 4] >> (child & 3u) * 8u & 0xffu; }

Box wideChild(Words node, uint child) {
    uint meta = byteOf(node, 6, child);
    if (meta == 0u) return emptyBox();
    uint internal = node.word[3] >> 24;
    if ((internal >> child & 1u) == 0u) return slotsBox(node.word[5] + (meta & 31u), bitCount(meta >> 5));
    uint number = node.word[4] + bitCount(internal & ((1u << child) - 1));
    if (number >= job.nodeCapacity) return emptyBox();
    return readBox(Corners(work(job.boxes)), number);
}

// The smallest power of two by whose 255 steps the extent is covered, as an exponent with its bias.
uint exponentOf(float extent) {
    const float kSlack = 1e-4;
    uint exponent = clamp(floatBitsToUint(extent / 255.0) >> 23, 1u, 253u);
    return ceil(extent / uintBitsToFloat(exponent << 23) + kSlack) > 255.0 ? exponent + 1 : exponent;
}

// Steps from the corner of the node, with what rounding may take away.
uint stepsDown(float distance_, float unit) { return uint(clamp(floor(distance_ / unit - 1e-4), 0.0, 255.0)); }

uint stepsUp(float distance_, float unit) { return uint(clamp(ceil(distance_ / unit + 1e-4), 0.0, 255.0)); }

// Boxes of all children, and what they have in common.
Box encode(Words node) {
    Box child[kChildren];
    Box all_ = emptyBox();
    [[dont_unroll]] for (uint i = 0; i < kChildren; ++i) {
        child[i] = wideChild(node, i);
        all_ = join(all_, child[i]);
    }
    vec3 corner = isEmpty(all_) ? vec3(0) : all_.lo;
    vec3 extent = isEmpty(all_) ? vec3(0) : all_.hi - all_.lo;
    uint exponents = 0u;
    [[dont_unroll]] for (uint axis = 0; axis < 3; ++axis) {
        uint exponent = exponentOf(extent[axis]);
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

void finishWide(Box box) {
    Corners to = Corners(plus(job.blob, 48u, 0u));
    to.corner[0] = box.lo;
    to.corner[1] = box.hi;
}

// Fits what can be fitted from node `i` up to the root: it starts where no child is a node.
void fitWideFrom(uint i) {
    uint nodes = min(header().word[8], job.nodeCapacity);
    if (nodes == 0u && i == 0u) finishWide(leafBox(header().word[2]));
    if (i >= nodes || wideAt(i).word[3] >> 24 != 0u) return;
    uint node = i;
    [[dont_unroll]] for (uint steps = 0; steps < nodes; ++steps) {
        Box box = encode(wideAt(node));
        writeBox(Corners(work(job.boxes)), node, box);
        uint parent = Words(job.parents).word[node];
        if (parent == kNone) {
            finishWide(box);
            return;
        }
        node = parent & 0x1fffffffu;
        if (node >= nodes) return;
        uint awaited = bitCount(wideAt(node).word[3] >> 24);
        memoryBarrierBuffer();
        if (atomicAdd(Words(work(job.arrivals)).word[node], 1u) + 1 < awaited) return;
        memoryBarrierBuffer();
    }
}
