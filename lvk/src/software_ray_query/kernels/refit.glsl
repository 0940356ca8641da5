// Rewrites the content of leaves from the caller's current buffers; their order and their ids stay.

// Returns the geometry and the primitive in a slot.
uvec2 numbersAt(uint slot) {
    if (namesVertices()) {
        uint both = job.leafKind == kIndexedTriangles ? slotAt(slot, 16u).quad[0].w : packedAt(slot).triple[0].z;
        return job.inputCount > 1u ? uvec2(both >> 24, both & 0x00ffffffu) : uvec2(0u, both);
    }
    Quads kept = slotAt(slot, job.leafKind == kBoxes ? 32u : 48u);
    return uvec2(kept.quad[1].w & 0x7fffffffu, kept.quad[0].w);
}

// Moves the vertices of a slot. Invocations that share a vertex write the same numbers.
void moveVertices(uint slot, Geometry g, Primitive from) {
    if (any(greaterThanEqual(from.corner, uvec3(g.vertexCount)))) return;
    uvec3 named = namedVertices(slot);
    Corners kept = Corners(place(job.vertices));
    kept.corner[named.x] = from.a;
    kept.corner[named.y] = from.b;
    kept.corner[named.z] = from.c;
}

void refitPrimitive(uint slot) {
    uvec2 numbers = numbersAt(slot);
    if (numbers.x >= job.inputCount) return;
    Geometry g = readGeometry(numbers.x);
    Primitive found = readPrimitive(g, numbers.y);
    if (namesVertices()) {
        moveVertices(slot, g, found);
        return;
    }
    if (!found.isActive) found.a = found.b = found.c = uintBitsToFloat(uvec3(0x7fc00000u));
    writePrimitive(slot, numbers.x, numbers.y, g, found);
}

// Writes the parent of a node's children, and resets its arrival counter.
void prepareBinary(uint node) {
    resetArrivals(node);
    Words from = Words(element(job.binary, node, 64u));
    for (uint which = 0; which < 2; ++which) {
        uint child = from.word[3 + which * 4];
        if (child < job.nodeCapacity) writeParent(child, node, which);
    }
}

void prepareWide(uint node) {
    writeArrivals(node, false);
    uint first = wideAt(node).word[4];
    uint end = min(first + bitCount(wideAt(node).word[3] >> 24), job.nodeCapacity);
    [[dont_unroll]] for (uint child = first; child < end; ++child) writeParent(child, node, 0u);
}

// Prepares everything with index `i` that fitting of bounds needs.
void refitFrom(uint i) {
    if (i < min(header().word[8], job.nodeCapacity)) {
        if (header().word[0] == kBinary) prepareBinary(i);
        else prepareWide(i);
        if (i == 0u) Words(job.parents).word[0] = kNone;
    }
    if (i < min(header().word[3], job.count)) refitPrimitive(i);
}
