// Primitives of leaves as the structure keeps them.
Quads slotAt(uint slot, uint bytes) { return Quads(element(place(job.primitives), slot, bytes)); }

bool namesVertices() { return job.leafKind == kIndexedTriangles || job.leafKind == kPackedTriangles; }

// Three words, where leaves are packed.
Triples packedAt(uint slot) { return Triples(element(place(job.primitives), slot, 12u)); }

// Packed leaves have 21 bits for each vertex: two words begin with one each, and share the third above them.
const uint kNameBits = 21u;
const uint kRestBits = 32u - kNameBits;

// The vertices that a slot names.
uvec3 namedVertices(uint slot) {
    if (job.leafKind == kIndexedTriangles) return slotAt(slot, 16u).quad[0].xyz;
    uvec2 names = packedAt(slot).triple[0].xy;
    uvec2 rest = names >> kNameBits;
    return uvec3(names & ((1u << kNameBits) - 1u), rest.x | rest.y << kRestBits);
}

// The box of what lies in a slot.
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
