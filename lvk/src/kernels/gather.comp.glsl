// Gathers the indices or AABBs of a part of a mesh: input i of the part is input numbers[i] of the mesh.
layout(local_size_x = 64) in;

const uint kNoIndices = 0u;
const uint kIndices16 = 1u;
const uint kIndices32 = 2u;

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Words { uint word[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Gathered { uint word[]; };

layout(push_constant, scalar) uniform Push {
    Words numbers;
    uvec2 source;      // address, a multiple of 4 (16-bit indices: rounded down)
    Gathered gathered;
    uint count;
    uint kind;
    uint oddHalf;      // 1 if the first 16-bit index is two bytes after `source`
    uint boxStride;    // bytes from one AABB to the next
};

Words at(uvec2 base, uint index, uint stride) {
    uint high, low, carry;
    umulExtended(index, stride, high, low);
    uint sum = uaddCarry(base.x, low, carry);
    return Words(uvec2(sum, base.y + high + carry));
}

uint index16(uint place) {
    uint word = Words(source).word[(place + oddHalf) >> 1];
    return (place + oddHalf & 1u) == 0u ? word & 0xffffu : word >> 16;
}

void main() {
    uint i = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * gl_NumWorkGroups.x * gl_WorkGroupSize.x;
    if (i >= count) return;
    uint number = numbers.word[i];
    if (kind > kIndices32) {
        Words box = at(source, number, boxStride);
        for (uint k = 0; k < 6; ++k) gathered.word[i * 6 + k] = box.word[k];
        return;
    }
    for (uint k = 0; k < 3; ++k) {
        uint place = number * 3 + k;
        uint index = kind == kNoIndices ? place : kind == kIndices16 ? index16(place) : at(source, place, 4).word[0];
        gathered.word[i * 3 + k] = index;
    }
}
