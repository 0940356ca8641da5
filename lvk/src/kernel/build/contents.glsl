void writeGeometry(uint i) {
    Quads(element(place(job.geometries), i, 16u)).quad[0] = uvec4(readGeometry(i).flags, uvec3(0));
}

// Everything of the structure but its boxes that has number `i`.
void writeTree(uint i) {
    writeHierarchy(i);
    uint actives = state().word[kActive];
    if (i < job.inputCount) writeGeometry(i);
    if (i < actives) {
        uint number = Words(work(job.keys)).word[job.count + i];
        uint geometry = geometryOf(number, false);
        Geometry g = readGeometry(geometry);
        uint index = number - g.firstPrimitive;
        writePrimitive(i, geometry, index, g, readPrimitive(g, index));
    }
    if (namesVertices() && i < job.vertexCount) copyVertex(i);
}
