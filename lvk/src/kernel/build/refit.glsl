// Rewrites the primitives of leaves from the caller's current buffers; their order and their ids stay.
void refitPrimitive(uint slot) {
    Quads kept = slotAt(slot, job.leafKind == kBoxes ? 32u : 48u);
    uint index = kept.quad[0].w;
    uint geometry = kept.quad[1].w & 0x7fffffffu;
    if (geometry >= job.inputCount) return;
    Geometry g = readGeometry(geometry);
    Primitive found = readPrimitive(g, index);
    if (!found.isActive) found.a = found.b = found.c = uintBitsToFloat(uvec3(0x7fc00000u));
    writePrimitive(slot, geometry, index, g, found);
}

// Everything that must be ready before boxes are fitted and has number `i`.
void refitFrom(uint i) {
    if (i < min(header().word[8], job.nodeCapacity)) {
        if (header().word[0] == kBinary) resetArrivals(i);
        else Words(work(job.arrivals)).word[i] = 0u;
    }
    if (namesVertices()) {
        if (i < job.vertexCount) copyVertex(i);
    } else if (i < min(header().word[3], job.count)) {
        refitPrimitive(i);
    }
}
