// Writes all parts of a BLAS except its nodes, which are complete now.
void writeGeometry(uint i) {
    Quads(element(place(job.geometries), i, 16u)).quad[0] = uvec4(readGeometry(i).flags, uvec3(0));
}

// Returns the index of the primitive for a slot.
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

// Replaces the header of binary nodes by that of wide ones; bounds stay.
void writeWideHeader() {
    uint actives = state().word[kActive];
    uint nodes = isPacked() ? packedNodes().y : state().word[kWideNodes];
    uint root = actives == 0u ? kNone : nodes != 0u ? 0u : kLeaf | actives - 1u << 27;
    Quads to = Quads(job.blob);
    to.quad[0] = uvec4(kWide, job.leafKind, root, actives);
    to.quad[2] = uvec4(nodes, job.inputCount, 0u, job.headerFlags);
    header().word[18] = 0u;
}

// Writes the parts with index `i`.
void placePart(uint i) {
    if (i < job.inputCount) writeGeometry(i);
    if (i < state().word[kActive]) placeSlot(i);
    if (namesVertices() && i < job.vertexCount) copyVertex(i);
    if (isPacked()) writePacked(i);
    if (i == 0u) writeWideHeader();
}
