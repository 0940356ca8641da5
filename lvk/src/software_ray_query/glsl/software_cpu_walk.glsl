#ifndef LVK_SOFTWARE_CPU_WALK_GLSL
#define LVK_SOFTWARE_CPU_WALK_GLSL

// Part of <lvk/software_walk.glsl>: how CPUs walk what most scenes are made of, a wide tree of triangles, all of them taken for
// opaque. A CPU runs eight invocations as one. What it guesses wrong costs it most, so there are few branches, and what
// follows a test does not wait for its outcome; and each turn does what most of the eight have to do.

// What the walk keeps of a level besides.
struct LvkSoftTriangleLevel {
    LvkSoftItems nodes;
    LvkSoftItems triangles;
    LvkSoftOrder order;
    vec2 wholes; // what the areas of a triangle come to, if the side the ray sees counts, lies between these
};

LvkSoftTriangleLevel lvkSoftTriangleLevelOf(LvkSoftLevel level) {
    const float kInfinite = uintBitsToFloat(0x7F800000u);
    bool negativeIsFront = lvkSoftIsFront(level.shear, -1.0) != level.flip;
    float least = (level.cull & lvkSoftCulling(negativeIsFront)) != 0u ? 0.0 : -kInfinite;
    float most = (level.cull & lvkSoftCulling(!negativeIsFront)) != 0u ? 0.0 : kInfinite;
    return LvkSoftTriangleLevel(lvkSoftItems(level.structure, level.nodes),
                                lvkSoftItems(level.structure, level.primitives), lvkSoftOrderOf(level.slabs),
                                vec2(least, most));
}

// The triangle that is nearest so far: its place, or LVK_SOFT_NONE, and what its areas come to.
struct LvkSoftNearest {
    uint primitive;
    float whole;
};

// Tests the next triangle of the group, and commits where it is hit if that counts. Whether the ray ends there. What the
// triangle says of itself is read once the nearest is known.
bool lvkSoftTestTriangle(inout LvkSoftState state, inout LvkSoftPlace place, LvkSoftLevel level,
                         LvkSoftTriangleLevel triangles, bool counts, inout LvkSoftNearest nearest) {
    uint primitive = place.leaves.x + uint(findLSB(place.leaves.y));
    place.leaves.y &= place.leaves.y - 1u;
    vec3 corners[3], lengths;
    uvec3 words;
    lvkSoftReadTriangle(lvkSoftItem(triangles.triangles, primitive, LVK_SOFT_TRIANGLE_BLOCKS), 0u, corners, words);
    vec3 areas = lvkSoftAreas(level.shear, level.slabs.origin, corners, lengths);
    float whole = areas.x + areas.y + areas.z;
    vec3 shares = lvkSoftShares(areas, whole);
    float t = lvkSoftDistance(level.shear, shares, lengths);
    bool passes = all(greaterThanEqual(areas, vec3(0.0))) || all(lessThanEqual(areas, vec3(0.0)));
    bool isSeen = whole > triangles.wholes.x && whole < triangles.wholes.y && whole != 0.0;
    bool hits = passes && isSeen && t > state.tMin && t < state.committed.t && counts;
    nearest.primitive = hits ? primitive : nearest.primitive;
    nearest.whole = hits ? whole : nearest.whole;
    state.committed.t = hits ? t : state.committed.t;
    state.committed.barycentrics = hits ? shares.yz : state.committed.barycentrics;
    return hits && (state.flags & LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT) != 0u;
}

// Visits the next node of the group. The rest of the group goes on the stack only if it has inner children that the ray meets.
void lvkSoftVisitWide(inout LvkSoftPlace place, LvkSoftLevel level, LvkSoftTriangleLevel triangles, vec2 range) {
    uint node = lvkSoftTakeNode(place, level);
    uvec4 met = lvkSoftMeetNode(level.slabs, triangles.order,
                                lvkSoftItem(triangles.nodes, node, LVK_SOFT_WIDE_NODE_BLOCKS), range);
    bool goesIn = met.y >= LVK_SOFT_ANY_NODE;
    if (goesIn && place.group.y >= LVK_SOFT_ANY_NODE) {
        lvkSoftPushGroup(place.top, place.group);
    }
    place.group = goesIn ? met.xy : place.group;
    place.leaves = met.zw;
}

// Fills in what was hit.
void lvkSoftTell(inout LvkSoftHit hit, LvkSoftLevel level, LvkSoftItems triangles, uint instance, LvkSoftNearest nearest) {
    vec3 corners[3];
    uvec3 words;
    lvkSoftReadTriangle(lvkSoftItem(triangles, nearest.primitive, LVK_SOFT_TRIANGLE_BLOCKS), 0u, corners, words);
    hit.kind = 1u;
    hit.instance = instance;
    hit.primitive = nearest.primitive;
    hit.front = lvkSoftIsFront(level.shear, nearest.whole) != level.flip;
    hit.numbers = lvkSoftNumbers(words, LVK_SOFT_TRIANGLES, level.several);
    hit.opaque = (words.z & 1u) != 0u;
}

// Walks through the structure of a level. A turn tests up to two triangles and visits a node if none is left then. A ray that
// ends does so after that, as the others need the visit anyway.
void lvkSoftWalkTriangles(inout LvkSoftState state, inout LvkSoftPlace place, LvkSoftLevel level) {
    LvkSoftTriangleLevel triangles = lvkSoftTriangleLevelOf(level);
    LvkSoftNearest nearest = LvkSoftNearest(LVK_SOFT_NONE, 0.0);
    bool ends = false;
    while (!ends) {
        if (place.leaves.y != 0u) {
            ends = lvkSoftTestTriangle(state, place, level, triangles, true, nearest);
        }
        if (place.leaves.y != 0u) {
            ends = lvkSoftTestTriangle(state, place, level, triangles, !ends, nearest) || ends;
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
                lvkSoftVisitWide(place, level, triangles, vec2(state.tMin, state.committed.t));
            }
        }
    }
    if (nearest.primitive != LVK_SOFT_NONE) {
        lvkSoftTell(state.committed, level, triangles.triangles, place.instance, nearest);
    }
    if (ends) {
        lvkSoftFinish(place);
    }
    place.instance = LVK_SOFT_NONE;
}

#endif
