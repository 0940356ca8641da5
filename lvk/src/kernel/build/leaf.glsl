// Primitives of leaves as the structure keeps them.
const uint kTriangleWords = 12u;
const uint kIndexedWords = 4u;
const uint kBoxWords = 8u;

vec3 readVec3(Floats from, uint at) { return vec3(from.value[at], from.value[at + 1], from.value[at + 2]); }

void writeVec3(Floats to, uint at, vec3 v) {
    to.value[at] = v.x;
    to.value[at + 1] = v.y;
    to.value[at + 2] = v.z;
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
