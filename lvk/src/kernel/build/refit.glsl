const uint kBinary = 1u;

// Rewrites the primitives of leaves from the caller's current buffers; their order and their ids stay.
void refitPrimitive(uint slot) {
    Words kept = Words(place(job.primitives));
    bool boxes = job.leafKind == kBoxes;
    uint at = slot * (boxes ? kBoxWords : kTriangleWords);
    uint index = kept.word[at + 3];
    uint geometry = kept.word[at + 7] & 0x7fffffffu;
    if (geometry >= job.inputCount) return;
    Geometry g = Geometries(job.inputs).geometry[geometry];
    Primitive found = readPrimitive(g, index);
    Floats numbers = Floats(place(job.primitives));
    if (!found.isActive) found.a = found.b = found.c = uintBitsToFloat(uvec3(0x7fc00000u));
    writeVec3(numbers, at, found.a);
    writeVec3(numbers, at + 4, found.b);
    if (!boxes) writeVec3(numbers, at + 8, found.c);
}

// Everything that must be ready before boxes are fitted and has number `i`.
void refitFrom(uint i) {
    if (i < min(header().word[8], job.nodeCapacity)) {
        if (header().word[0] == kBinary) resetArrivals(i);
        else Words(work(job.arrivals)).word[i] = 0u;
    }
    if (job.leafKind == kIndexedTriangles) {
        if (i < job.vertexCount) copyVertex(i);
    } else if (i < min(header().word[3], job.count)) {
        refitPrimitive(i);
    }
}
