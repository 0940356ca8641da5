#ifndef LVK_SOFTWARE_CPU_NODE_GLSL
#define LVK_SOFTWARE_CPU_NODE_GLSL

#include <lvk/software_boxes.glsl>

// Intersection of a ray with the bounds of a wide node on CPUs, like <lvk/software_wide_node.glsl> on GPUs. The cost on
// a CPU is the number of instructions, mainly of those that only the multiply-add unit executes: conversions, minima
// and maxima.

// The position of the near planes along each axis: bytes from a node's start. With 16-byte blocks: true if they are the
// first half of a block. The far planes are the other half.
#ifdef LVK_GATHERS_PAIRS
#define LvkSoftOrder u64vec3
LvkSoftOrder lvkSoftOrderOf(LvkSoftSlabs ray) {
    return u64vec3((ray.octant & 4u) != 0u ? 32ul : 40ul, (ray.octant & 2u) != 0u ? 48ul : 56ul,
                   (ray.octant & 1u) != 0u ? 64ul : 72ul);
}

// Returns the planes of eight children, in two words, along the axis of a block.
void lvkSoftPlanes(LvkSoftBlocks node, uint block, uint64_t order, out uvec2 near, out uvec2 far) {
    uint64_t start = packUint2x32(uvec2(node));
    uint64_t halves = uint64_t(block) * 32ul + 8ul; // sum of the offsets of both halves of the block
    near = unpackUint2x32(LvkSoftPair(start + order).at);
    far = unpackUint2x32(LvkSoftPair(start + (halves - order)).at);
}
#else
#define LvkSoftOrder bvec3
LvkSoftOrder lvkSoftOrderOf(LvkSoftSlabs ray) {
    return bvec3((ray.octant & 4u) != 0u, (ray.octant & 2u) != 0u, (ray.octant & 1u) != 0u);
}

void lvkSoftPlanes(LvkSoftBlocks node, uint block, bool order, out uvec2 near, out uvec2 far) {
    uvec4 planes = node.at[block];
    near = order ? planes.xy : planes.zw;
    far = order ? planes.zw : planes.xy;
}
#endif

// Converts the planes of a child, bytes in each word, to floats without conversion instructions: as mantissa bits of
// floats from 1 to 2, in steps of 1 / 32768.
vec3 lvkSoftSteps(uvec3 words, uint child) {
    uvec3 moved = child == 0u ? words << 8 : words >> (child - 8u);
    return uintBitsToFloat(moved & 0xFF00u | 0x3F800000u);
}

// Rotates bits to the left. Only the lowest five bits of `by` count, so that the caller need not clear the bits above
// them.
uint lvkSoftRotate(uint bits, uint by) {
    return bits << (by & 31u) | bits >> (-by & 31u);
}

// Returns the children, of four of a wide node, that the ray hits, as bits at their positions. The ray enters a plane
// at its index times `scale` after `start`, and leaves it at that distance after `end`.
uint lvkSoftIntersect4(uvec3 near, uvec3 far, uint counts, uint shifts, vec3 scale, vec3 start, vec3 end, vec2 range) {
    uint hits = 0u;
    [[unroll]] for (uint child = 0u; child < 32u; child += 8u) {
        float enter = lvkSoftLastEntry(lvkSoftSteps(near, child) * scale + start);
        float leave = lvkSoftFirstExit(lvkSoftSteps(far, child) * scale + end);
        bool isHit = enter <= leave && enter <= range.y && leave >= range.x;
        hits |= isHit ? lvkSoftRotate(counts >> child & 7u, shifts >> child) : 0u;
    }
    return hits;
}

// Returns the hits of a wide node, in the format of lvkSoftIntersect8.
uvec4 lvkSoftIntersectNode(LvkSoftSlabs ray, LvkSoftOrder order, LvkSoftBlocks node, vec2 range) {
    uvec4 head = lvkSoftBlock(node, 0u);
    uvec4 children = lvkSoftBlock(node, 1u);
    uvec2 nearX, nearY, nearZ, farX, farY, farZ;
    lvkSoftPlanes(node, 2u, order.x, nearX, farX);
    lvkSoftPlanes(node, 3u, order.y, nearY, farY);
    lvkSoftPlanes(node, 4u, order.z, nearZ, farZ);
    // Exponents are larger by the 15 bits of lvkSoftSteps. None overflows its byte, because bounds end at 1e15, and
    // LVK_SOFT_LEAST_OF_FAR keeps distances finite. Rounding affects `start`, and the rest at the size of `scale`.
    vec3 scale = uintBitsToFloat((head.www + 0x0F0F0Fu >> uvec3(0u, 8u, 16u) & 255u) << 23) * ray.inverse;
    vec3 start = (uintBitsToFloat(head.xyz) - ray.origin) * ray.inverse;
    vec3 error = (abs(start) + abs(scale)) * 1e-6;
    vec3 enter = start - scale - error, leave = start - scale + error;
    // The position of inner children is 24 and more; it is permuted by the order of the ray.
    uvec2 inner = children.zw & (children.zw << 1) & 0x10101010u;
    uvec2 shifts = children.zw ^ ((inner >> 1) - (inner >> 4) & ray.octant * 0x01010101u);
    uvec2 counts = children.zw >> 5;
    uint hits = lvkSoftIntersect4(uvec3(nearX.x, nearY.x, nearZ.x), uvec3(farX.x, farY.x, farZ.x), counts.x, shifts.x,
                                  scale, enter, leave, range);
    hits |= lvkSoftIntersect4(uvec3(nearX.y, nearY.y, nearZ.y), uvec3(farX.y, farY.y, farZ.y), counts.y, shifts.y,
                              scale, enter, leave, range);
    return uvec4(children.x, hits & 0xFF000000u | head.w >> 24, children.y, hits & 0x00FFFFFFu);
}

// See <lvk/software_wide_node.glsl>.
uvec4 lvkSoftIntersect8(LvkSoftSlabs ray, uvec2 structure, uint nodes, uint node, vec2 range) {
    LvkSoftItems items = lvkSoftItems(structure, nodes);
    return lvkSoftIntersectNode(ray, lvkSoftOrderOf(ray), lvkSoftItem(items, node, LVK_SOFT_WIDE_NODE_BLOCKS), range);
}

#endif
