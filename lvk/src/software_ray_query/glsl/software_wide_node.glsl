#ifndef LVK_SOFTWARE_WIDE_NODE_GLSL
#define LVK_SOFTWARE_WIDE_NODE_GLSL

#include <lvk/software_boxes.glsl>

// Intersection of a ray with the bounds of a wide node; on CPUs see <lvk/software_cpu_node.glsl>.

// Returns the children, of four of a wide node, that the ray hits, as bits at their positions.
uint lvkSoftIntersect4(uvec3 near, uvec3 far, uint counts, uint shifts, vec3 scale, vec3 start, vec3 end, vec2 range) {
    uint hits = 0u;
    [[unroll]] for (uint child = 0u; child < 32u; child += 8u) {
        vec3 enter = vec3(near >> child & 255u) * scale + start;
        vec3 leave = vec3(far >> child & 255u) * scale + end;
        bool isHit = lvkSoftLast(enter, range.x) <= lvkSoftFirst(leave, range.y);
        hits |= isHit ? (counts >> child & 7u) << (shifts >> child & 31u) : 0u;
    }
    return hits;
}

// Returns the hits of a wide node (Ylitie, Karras and Laine, "Efficient Incoherent Ray Traversal on GPUs Through
// Compressed Wide BVHs", 2017). The hit inner children are a node group: the first node, and from bit 24 on a bit for
// each, in the order of the ray. The hit leaves are a primitive group: the first primitive and a bit for each. `nodes`
// is the first block of nodes.
uvec4 lvkSoftIntersect8(LvkSoftSlabs ray, uvec2 structure, uint nodes, uint node, vec2 range) {
    LvkSoftBlocks blocks = LvkSoftBlocks(structure);
    uint first = nodes + node * LVK_SOFT_WIDE_NODE_BLOCKS;
    uvec4 head = lvkSoftBlock(blocks, first);
    uvec4 children = lvkSoftBlock(blocks, first + 1u);
    uvec4 x = lvkSoftBlock(blocks, first + 2u);
    uvec4 y = lvkSoftBlock(blocks, first + 3u);
    uvec4 z = lvkSoftBlock(blocks, first + 4u);
    vec3 scale = uintBitsToFloat((head.www >> uvec3(0u, 8u, 16u) & 255u) << 23) * ray.inverse;
    vec3 start = (uintBitsToFloat(head.xyz) - ray.origin) * ray.inverse;
    vec3 error = (abs(start) + 256.0 * abs(scale)) * 1e-6;
    bvec3 along = bvec3(ray.octant & 4u, ray.octant & 2u, ray.octant & 1u);
    uvec4 nearX = along.x ? x : x.zwxy;
    uvec4 nearY = along.y ? y : y.zwxy;
    uvec4 nearZ = along.z ? z : z.zwxy;
    // The position of inner children is 24 and more; it is permuted by the order of the ray.
    uvec2 inner = (children.zw & (children.zw << 1) & 0x10101010u) >> 4;
    uvec2 counts = children.zw >> 5 & 0x07070707u;
    uvec2 shifts = (children.zw ^ inner * ray.octant) & 0x1F1F1F1Fu;
    uint hits = lvkSoftIntersect4(uvec3(nearX.x, nearY.x, nearZ.x), uvec3(nearX.z, nearY.z, nearZ.z), counts.x,
                                  shifts.x, scale, start - error, start + error, range);
    hits |= lvkSoftIntersect4(uvec3(nearX.y, nearY.y, nearZ.y), uvec3(nearX.w, nearY.w, nearZ.w), counts.y,
                              shifts.y, scale, start - error, start + error, range);
    return uvec4(children.x, hits & 0xFF000000u | head.w >> 24, children.y, hits & 0x00FFFFFFu);
}

#endif
