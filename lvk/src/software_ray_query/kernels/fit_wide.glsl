// Fits the bounds of wide nodes, bottom up, and encodes them again. The references to children stay.
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

// Encodes a node again around its children; returns the union of their bounds.
Box encodeAnew(Words node) {
    Box child[kChildren];
    [[dont_unroll]] for (uint i = 0; i < kChildren; ++i) child[i] = wideChild(node, i);
    return encode(node, child);
}

void finishWide(Box box) {
    Corners to = Corners(plus(job.blob, 48u, 0u));
    to.corner[0] = box.lo;
    to.corner[1] = box.hi;
}

// Fits nodes from node `i` up to the root, as far as possible. Starts at nodes without inner children.
void fitWideFrom(uint i) {
    uint nodes = min(header().word[8], job.nodeCapacity);
    if (nodes == 0u && i == 0u) finishWide(leafBox(header().word[2]));
    if (i >= nodes || wideAt(i).word[3] >> 24 != 0u) return;
    uint node = i;
    [[dont_unroll]] for (uint steps = 0; steps < nodes; ++steps) {
        Box box = encodeAnew(wideAt(node));
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
