void writeGeometry(uint i) {
    Words to = Words(plus(place(job.geometries), i << 4, i >> 28));
    to.word[0] = Geometries(job.inputs).geometry[i].flags;
    to.word[1] = to.word[2] = to.word[3] = 0u;
}

// Everything of the structure but its boxes that has number `i`.
void writeTree(uint i) {
    writeHierarchy(i);
    uint actives = state().word[kActive];
    if (i < job.inputCount) writeGeometry(i);
    if (i < actives) {
        uint number = Words(work(job.keys)).word[job.count + i];
        uint geometry = geometryOf(number, false);
        Geometry g = Geometries(job.inputs).geometry[geometry];
        uint index = number - g.firstPrimitive;
        writePrimitive(i, geometry, index, g, readPrimitive(g, index));
    }
    if (job.leafKind == kIndexedTriangles && i < job.vertexCount) copyVertex(i);
}
