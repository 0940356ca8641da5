// Everything of a bottom-level structure but its nodes, which are known by now.
void writeGeometry(uint i) {
    Quads(element(place(job.geometries), i, 16u)).quad[0] = uvec4(readGeometry(i).flags, uvec3(0));
}

// The number of the primitive that belongs into a slot.
uint numberOf(uint slot) {
    bool isSorted = isPacked() || state().word[kWideNodes] == 0u;
    return isSorted ? Words(work(job.keys)).word[job.count + slot] : Words(work(job.spareKeys)).word[slot];
}

void placeSlot(uint slot) {
    uint number = numberOf(slot);
    uint geometry = geometryOf(number, false);
    Geometry g = readGeometry(geometry);
    uint index = number - g.firstPrimitive;
    writePrimitive(slot, geometry, index, g, readPrimitive(g, index));
}

// The header of wide nodes, in place of that of binary ones; bounds stay.
void writeWideHeader() {
    uint actives = state().word[kActive];
    uint nodes = isPacked() ? packedNodes().y : state().word[kWideNodes];
    uint root = actives == 0u ? kNone : nodes != 0u ? 0u : kLeaf | actives - 1u << 27;
    Quads to = Quads(job.blob);
    to.quad[0] = uvec4(kWide, job.leafKind, root, actives);
    to.quad[2] = uvec4(nodes, job.inputCount, 0u, job.headerFlags);
    header().word[18] = 0u;
}

// Whatever has number `i`.
void placePart(uint i) {
    if (i < job.inputCount) writeGeometry(i);
    if (i < state().word[kActive]) placeSlot(i);
    if (namesVertices() && i < job.vertexCount) copyVertex(i);
    if (isPacked()) writePacked(i);
    if (i == 0u) writeWideHeader();
}
