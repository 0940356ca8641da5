#ifndef LVK_SOFTWARE_BOXES_GLSL
#define LVK_SOFTWARE_BOXES_GLSL

#include <lvk/software_layout.glsl>

// A ray against the boxes of a node. Every test errs on the side of a hit, by more than rounding can be wrong, so that
// the triangles alone decide.

// What of a ray the boxes of a level share.
struct LvkSoftSlabs {
    vec3 origin;
    vec3 inverse; // of the direction, never infinite
    uint octant;  // a bit for each axis the ray follows: x 4, y 2, z 1
};

// What a component of a direction in the world counts as at least: times to the ends of boxes, at 1e15, are finite numbers.
#define LVK_SOFT_LEAST 1e-22

// The same, as a share of the longest component.
#define LVK_SOFT_LEAST_SHARE 1e-18

// The same, as a share of how far away the corners of a structure are. On CPUs nodes count with times that are up to 520 times as long.
#ifdef LVK_DEVICE_IS_CPU
#define LVK_SOFT_LEAST_OF_FAR 1e-35
#else
#define LVK_SOFT_LEAST_OF_FAR 1e-37
#endif

float lvkSoftLongest(vec3 v) {
    vec3 size = abs(v);
    return max(max(size.x, size.y), size.z);
}

// The least for a ray in the space of a structure. What suits corners at 1e15 would be too much of short directions, as they are in
// large instances; there it follows from how far away the structure's own corners are.
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

// How much wider boxes must be, as the time a ray takes for it along each axis, for a share of the furthest coordinate.
vec3 lvkSoftSlack(LvkSoftSlabs ray, vec3 far, float share) {
    return abs(ray.inverse) * (lvkSoftLongest(far) * share);
}

// Of boxes in the world: in the space of an instance the ray begins elsewhere by some roundings of its origin's coordinates.
vec3 lvkSoftWorldSlack(LvkSoftSlabs ray) {
    return lvkSoftSlack(ray, abs(ray.origin), 2e-6);
}

// Of a box that the ray may touch without entering it: it runs along a face, or the box is flat and the ray in its plane. Such a
// box is left when it is entered, however long the ray takes to get there.
vec3 lvkSoftTouchSlack(LvkSoftSlabs ray, vec3 low, vec3 high) {
    const float kFarthest = 1e16; // behind all corners but those of boxes that hold nothing
    vec3 far = max(abs(low - ray.origin), abs(high - ray.origin));
    return lvkSoftSlack(ray, min(far, vec3(kFarthest)), 1e-7);
}

// The last of the distances at which a ray enters, or any negative one if all are. As integers, positive floats are in order and
// before them all negative ones, and devices may have instructions for the most of three integers.
float lvkSoftLastEntry(vec3 enter) {
    ivec3 all = floatBitsToInt(enter);
    return intBitsToFloat(max(max(all.x, all.y), all.z));
}

// The first of the distances at which it leaves; any negative one if there are such.
float lvkSoftFirstExit(vec3 leave) {
    ivec3 all = floatBitsToInt(leave);
    return intBitsToFloat(min(min(all.x, all.y), all.z));
}

// The same within the range of a ray, whose tMin is not negative.
float lvkSoftLast(vec3 enter, float tMin) {
    return intBitsToFloat(max(floatBitsToInt(lvkSoftLastEntry(enter)), floatBitsToInt(tMin)));
}

float lvkSoftFirst(vec3 leave, float tMax) {
    return intBitsToFloat(min(floatBitsToInt(lvkSoftFirstExit(leave)), floatBitsToInt(tMax)));
}

// Where the ray enters and leaves a box, of the range it has left. Which corner is near follows from the direction: a box that
// holds nothing, whose low corner lies above the high one, is left before it is entered. Along each axis the box is wider by
// what a ray takes `slack` for.
vec2 lvkSoftCross(LvkSoftSlabs ray, vec3 low, vec3 high, vec2 range, vec3 slack) {
    const float kLess = 1.0 - 5e-7, kMore = 1.0 + 5e-7;
    vec3 a = (low - ray.origin) * ray.inverse;
    vec3 b = (high - ray.origin) * ray.inverse;
    bvec3 along = greaterThan(ray.inverse, vec3(0.0));
    vec3 near = mix(b, a, along) - slack;
    vec3 far = mix(a, b, along) + slack;
    return vec2(lvkSoftLast(near, range.x) * kLess, lvkSoftFirst(far, range.y) * kMore);
}

// The children of a binary node that the ray meets, the nearer one first; LVK_SOFT_NONE for each it misses. `nodes` is the
// block where nodes begin. Boxes in the world are wider by `slack`; others, which are exact, by what a touch needs.
uvec2 lvkSoftMeet2(LvkSoftSlabs ray, LvkSoftBlocks blocks, uint nodes, uint node, vec2 range, bool inWorld, vec3 slack) {
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
