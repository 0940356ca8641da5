// Writes primitives of leaves.
void writePrimitive(uint slot, uint geometry, uint index, Geometry g, Primitive from) {
    Words kept = Words(place(job.primitives));
    Floats numbers = Floats(place(job.primitives));
    if (job.leafKind == kTriangles) {
        uint at = slot * kTriangleWords;
        writeVec3(numbers, at, from.a);
        kept.word[at + 3] = index;
        writeVec3(numbers, at + 4, from.b);
        kept.word[at + 7] = geometry;
        writeVec3(numbers, at + 8, from.c);
        kept.word[at + 11] = g.flags & 1u;
    } else if (job.leafKind == kIndexedTriangles) {
        uint at = slot * kIndexedWords;
        [[dont_unroll]] for (uint k = 0; k < 3; ++k) kept.word[at + k] = from.corner[k] + g.firstVertex;
        kept.word[at + 3] = index | (job.inputCount > 1 ? geometry << 24 : 0u);
    } else {
        uint at = slot * kBoxWords;
        writeVec3(numbers, at, from.a);
        kept.word[at + 3] = index;
        writeVec3(numbers, at + 4, from.b);
        kept.word[at + 7] = geometry | (g.flags & 1u) << 31;
    }
}

// The copy of vertices that indexed leaves name.
void copyVertex(uint i) {
    Geometry g = Geometries(job.inputs).geometry[geometryOf(i, true)];
    writeVec3(Floats(place(job.vertices)), i * 3, positionOf(g, i - g.firstVertex));
}
