// Primitives of leaves as the structure keeps them.
Quads slotAt(uint slot, uint bytes) { return Quads(element(place(job.primitives), slot, bytes)); }

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
