// Primitives of leaves, as stored in a BLAS.
Quads slotAt(uint slot, uint bytes) { return Quads(element(place(job.primitives), slot, bytes)); }

bool namesVertices() { return job.leafKind == kIndexedTriangles || job.leafKind == kPackedTriangles; }

// Returns the three words of a packed leaf.
Triples packedAt(uint slot) { return Triples(element(place(job.primitives), slot, 12u)); }

// Packed leaves have 21 bits for each vertex: two words start with one each, and share the third above them.
const uint kNameBits = 21u;
const uint kRestBits = 32u - kNameBits;

// Returns the vertex indices of a slot.
uvec3 namedVertices(uint slot) {
    if (job.leafKind == kIndexedTriangles) return slotAt(slot, 16u).quad[0].xyz;
    uvec2 names = packedAt(slot).triple[0].xy;
    uvec2 rest = names >> kNameBits;
    return uvec3(names & ((1u << kNameBits) - 1u), rest.x | rest.y << kRestBits);
}

// Returns the bounds of the content of a slot.
Box keptBox(uint slot);

Box slotsBox(uint first, uint count) {
    Box box = emptyBox();
    [[dont_unroll]] for (uint i = 0; i < count; ++i) box = join(box, keptBox(first + i));
    return box;
}

Box leafBox(uint reference) {
    if (reference == kNone) return emptyBox();
    return slotsBox(reference & 0x07ffffffu, (reference >> 27 & 15u) + 1);
}
