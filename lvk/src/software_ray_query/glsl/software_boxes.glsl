#ifndef LVK_SOFTWARE_BOXES_GLSL
#define LVK_SOFTWARE_BOXES_GLSL

#include <lvk/software_layout.glsl>

// Intersection of a ray with the bounds of a node. Every test is conservative by more than the rounding error, so that
// only the triangles decide.

// Values of a ray that all bounds of a level share.
struct LvkSoftSlabs {
    vec3 origin;
    vec3 inverse; // of the direction, never infinite
    uint octant;  // a bit for each axis with a positive direction: x 4, y 2, z 1
};

// Minimum magnitude of a direction component in the world. With it, distances to bounds at 1e15 are finite.
#define LVK_SOFT_LEAST 1e-22

// Minimum magnitude as a share of the longest component.
#define LVK_SOFT_LEAST_SHARE 1e-18

// Minimum magnitude as a share of the farthest vertex of a BLAS. Nodes on CPUs compute with distances up to 520 times
// as long.
#ifdef LVK_DEVICE_IS_CPU
#define LVK_SOFT_LEAST_OF_FAR 1e-35
#else
#define LVK_SOFT_LEAST_OF_FAR 1e-37
#endif

float lvkSoftLongest(vec3 v) {
    vec3 size = abs(v);
    return max(max(size.x, size.y), size.z);
}

// Returns the minimum magnitude for a ray in the space of a BLAS. The value for vertices at 1e15 would be too large for
// short directions, as in large instances. There, the farthest vertex of the BLAS determines it.
float lvkSoftLeast(uvec2 structure, vec3 origin, vec3 direction) {
    const float kMost = 1e15 * LVK_SOFT_LEAST_OF_FAR;
    if (lvkSoftLongest(direction) * LVK_SOFT_LEAST_SHARE >= kMost) {
        return kMost;
    }
    uvec4 a = lvkSoftBlock(LvkSoftBlocks(structure), 3u);
    uvec4 b = lvkSoftBlock(LvkSoftBlocks(structure), 4u);
    vec3 low = uintBitsToFloat(a.xyz), high = uintBitsToFloat(uvec3(a.w, b.xy));
    vec3 far = max(abs(origin), max(abs(low), abs(high)));
    return min(max(lvkSoftLongest(far), 1.0) * LVK_SOFT_LEAST_OF_FAR, kMost);
}

LvkSoftSlabs lvkSoftSlabsOf(vec3 origin, vec3 direction, float least) {
    least = max(least, lvkSoftLongest(direction) * LVK_SOFT_LEAST_SHARE);
    bvec3 isFlat = lessThan(abs(direction), vec3(least));
    vec3 replaced = mix(vec3(least), vec3(-least), lessThan(direction, vec3(0.0)));
    uint octant = (direction.x < 0.0 ? 0u : 4u) | (direction.y < 0.0 ? 0u : 2u) | (direction.z < 0.0 ? 0u : 1u);
    return LvkSoftSlabs(origin, 1.0 / mix(direction, replaced, isFlat), octant);
}

// Returns the distance along the ray, for each axis, that widens bounds by a share of the farthest coordinate.
vec3 lvkSoftSlack(LvkSoftSlabs ray, vec3 far, float share) {
    return abs(ray.inverse) * (lvkSoftLongest(far) * share);
}

// Slack of bounds in the world: in the space of an instance, the ray's origin differs by some rounding errors of its
// coordinates.
vec3 lvkSoftWorldSlack(LvkSoftSlabs ray) {
    return lvkSoftSlack(ray, abs(ray.origin), 2e-6);
}

// Slack of bounds that the ray may touch without entering: the ray runs along a face, or the bounds are flat and the
// ray is in their plane. The ray leaves such bounds at the entry distance, however large it is.
vec3 lvkSoftTouchSlack(LvkSoftSlabs ray, vec3 low, vec3 high) {
    const float kFarthest = 1e16; // beyond all vertices except those of empty bounds
    vec3 far = max(abs(low - ray.origin), abs(high - ray.origin));
    return lvkSoftSlack(ray, min(far, vec3(kFarthest)), 1e-7);
}

// Returns the largest entry distance, or any negative one if all are negative. As integers, positive floats keep their
// order and all negative ones precede them. Devices may have instructions for the maximum of three integers.
float lvkSoftLastEntry(vec3 enter) {
    ivec3 all = floatBitsToInt(enter);
    return intBitsToFloat(max(max(all.x, all.y), all.z));
}

// Returns the smallest exit distance; any negative one if there is one.
float lvkSoftFirstExit(vec3 leave) {
    ivec3 all = floatBitsToInt(leave);
    return intBitsToFloat(min(min(all.x, all.y), all.z));
}

// Like the two functions above, within the range of a ray, whose tMin is not negative.
float lvkSoftLast(vec3 enter, float tMin) {
    return intBitsToFloat(max(floatBitsToInt(lvkSoftLastEntry(enter)), floatBitsToInt(tMin)));
}

float lvkSoftFirst(vec3 leave, float tMax) {
    return intBitsToFloat(min(floatBitsToInt(lvkSoftFirstExit(leave)), floatBitsToInt(tMax)));
}

// Returns the entry and exit distance of bounds, within the remaining range of the ray. The direction selects the near
// side, so a ray leaves empty bounds (low above high) before it enters them. `slack` widens the bounds along each axis,
// as a distance along the ray.
vec2 lvkSoftCross(LvkSoftSlabs ray, vec3 low, vec3 high, vec2 range, vec3 slack) {
    const float kLess = 1.0 - 5e-7, kMore = 1.0 + 5e-7;
    vec3 a = (low - ray.origin) * ray.inverse;
    vec3 b = (high - ray.origin) * ray.inverse;
    bvec3 along = greaterThan(ray.inverse, vec3(0.0));
    vec3 near = mix(b, a, along) - slack;
    vec3 far = mix(a, b, along) + slack;
    return vec2(lvkSoftLast(near, range.x) * kLess, lvkSoftFirst(far, range.y) * kMore);
}

// Returns the children of a binary node that the ray hits, the nearer first; LVK_SOFT_NONE for each miss. `nodes` is
// the first block of nodes. `slack` widens bounds in the world. Other bounds are exact, and are widened by the slack
// for a touch.
uvec2 lvkSoftIntersect2(LvkSoftSlabs ray, LvkSoftBlocks blocks, uint nodes, uint node, vec2 range, bool inWorld,
                        vec3 slack) {
    uint first = nodes + node * LVK_SOFT_BINARY_NODE_BLOCKS;
    uvec4 a = lvkSoftBlock(blocks, first);
    uvec4 b = lvkSoftBlock(blocks, first + 1u);
    uvec4 c = lvkSoftBlock(blocks, first + 2u);
    uvec4 d = lvkSoftBlock(blocks, first + 3u);
    vec3 low1 = uintBitsToFloat(a.xyz), high1 = uintBitsToFloat(b.xyz);
    vec3 low2 = uintBitsToFloat(c.xyz), high2 = uintBitsToFloat(d.xyz);
    vec2 one = lvkSoftCross(ray, low1, high1, range, inWorld ? slack : lvkSoftTouchSlack(ray, low1, high1));
    vec2 two = lvkSoftCross(ray, low2, high2, range, inWorld ? slack : lvkSoftTouchSlack(ray, low2, high2));
    uint left = one.x <= one.y ? a.w : LVK_SOFT_NONE;
    uint right = two.x <= two.y ? b.w : LVK_SOFT_NONE;
    bool swap = left == LVK_SOFT_NONE || (right != LVK_SOFT_NONE && two.x < one.x);
    return swap ? uvec2(right, left) : uvec2(left, right);
}

#endif
