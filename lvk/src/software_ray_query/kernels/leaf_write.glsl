// Writes primitives of leaves.
void writeNames(uint slot, uvec3 vertices, uint number) {
    if (job.leafKind == kIndexedTriangles) {
        slotAt(slot, 16u).quad[0] = uvec4(vertices, number);
    } else {
        uvec2 rest = uvec2(vertices.z, vertices.z >> kRestBits);
        packedAt(slot).triple[0] = uvec3(vertices.xy | rest << kNameBits, number);
    }
}

void writePrimitive(uint slot, uint geometry, uint index, Geometry g, Primitive from) {
    if (job.leafKind == kTriangles) {
        Quads kept = slotAt(slot, 48u);
        kept.quad[0] = uvec4(floatBitsToUint(from.a), index);
        kept.quad[1] = uvec4(floatBitsToUint(from.b), geometry);
        kept.quad[2] = uvec4(floatBitsToUint(from.c), g.flags & 1u);
    } else if (namesVertices()) {
        writeNames(slot, from.corner + g.firstVertex, index | (job.inputCount > 1 ? geometry << 24 : 0u));
    } else {
        Quads kept = slotAt(slot, 32u);
        kept.quad[0] = uvec4(floatBitsToUint(from.a), index);
        kept.quad[1] = uvec4(floatBitsToUint(from.b), geometry | (g.flags & 1u) << 31);
    }
}

// Writes the copy of a vertex that leaves refer to.
void copyVertex(uint i) {
    Geometry g = readGeometry(geometryOf(i, true));
    Corners(place(job.vertices)).corner[i] = positionOf(g, i - g.firstVertex);
}
