#ifndef LVK_SOFTWARE_CPU_WALK_GLSL
#define LVK_SOFTWARE_CPU_WALK_GLSL

// Part of <lvk/software_walk.glsl>: how CPUs walk what most scenes are made of, a wide tree of triangles, all of them taken for
// opaque. A CPU runs eight invocations as one. What it guesses wrong costs it most, so there are few branches, and what
// follows a test does not wait for its outcome; and each turn does what most of the eight have to do.

// Tests the next triangle of the group, and commits what it hits if that counts; `nearest` becomes its place. Whether the ray
// ends there. What the triangle says of itself is read once the nearest is known.
bool lvkSoftTestTriangle(inout LvkSoftState state, inout LvkSoftPlace place, LvkSoftLevel level, bool counts,
                         inout uint nearest) {
    uint primitive = place.leaves.x + uint(findLSB(place.leaves.y));
    place.leaves.y &= place.leaves.y - 1u;
    vec3 corners[3];
    uvec3 words;
    lvkSoftCorners(level.structure, level.primitives, LVK_SOFT_TRIANGLES, primitive, corners, words);
    LvkSoftPassage passage;
    bool passes = lvkSoftPasses(level.shear, level.slabs.origin, corners, passage);
    bool front = passage.front != level.flip;
    bool isWithin = passage.t > state.tMin && passage.t < state.committed.t;
    bool hits = passes && isWithin && (level.cull & lvkSoftCulling(front)) == 0u && counts;
    nearest = hits ? primitive : nearest;
    state.committed.t = hits ? passage.t : state.committed.t;
    state.committed.barycentrics = hits ? passage.barycentrics : state.committed.barycentrics;
    state.committed.front = hits ? front : state.committed.front;
    return hits && (state.flags & LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT) != 0u;
}

// Visits the next node of the group. The rest of the group goes on the stack only if it has inner children that the ray meets.
void lvkSoftVisitWide(inout LvkSoftPlace place, LvkSoftLevel level, vec2 range) {
    uint node = lvkSoftTakeNode(place, level);
    uvec4 met = lvkSoftMeet8(level.slabs, LvkSoftBlocks(level.structure), level.nodes, node, range);
    bool goesIn = met.y >= LVK_SOFT_ANY_NODE;
    if (goesIn && place.group.y >= LVK_SOFT_ANY_NODE) {
        lvkSoftPushGroup(place.top, place.group);
    }
    place.group = goesIn ? met.xy : place.group;
    place.leaves = met.zw;
}

// Fills in what was hit.
void lvkSoftTell(inout LvkSoftHit hit, LvkSoftLevel level, uint instance, uint primitive) {
    vec3 corners[3];
    uvec3 words;
    lvkSoftCorners(level.structure, level.primitives, LVK_SOFT_TRIANGLES, primitive, corners, words);
    hit.kind = 1u;
    hit.instance = instance;
    hit.primitive = primitive;
    hit.numbers = lvkSoftNumbers(words, LVK_SOFT_TRIANGLES, level.several);
    hit.opaque = (words.z & 1u) != 0u;
}

// Walks through the structure of a level. A turn tests up to two triangles and visits a node if none is left then. A ray that
// ends does so after that, as the others need the visit anyway.
void lvkSoftWalkTriangles(inout LvkSoftState state, inout LvkSoftPlace place, LvkSoftLevel level) {
    uint nearest = LVK_SOFT_NONE;
    bool ends = false;
    while (!ends) {
        if (place.leaves.y != 0u) {
            ends = lvkSoftTestTriangle(state, place, level, true, nearest);
        }
        if (place.leaves.y != 0u) {
            ends = lvkSoftTestTriangle(state, place, level, !ends, nearest) || ends;
        }
        if (place.leaves.y == 0u) {
            if (place.group.y < LVK_SOFT_ANY_NODE) {
                if (place.top == place.floor) {
                    break;
                }
                place.group = lvkSoftPopGroup(place.top);
            }
            // Asked again, so that CPUs pass it by once all rays have left.
            if (place.group.y >= LVK_SOFT_ANY_NODE) {
                lvkSoftVisitWide(place, level, vec2(state.tMin, state.committed.t));
            }
        }
    }
    if (nearest != LVK_SOFT_NONE) {
        lvkSoftTell(state.committed, level, place.instance, nearest);
    }
    if (ends) {
        lvkSoftFinish(place);
    }
    place.instance = LVK_SOFT_NONE;
}

#endif
