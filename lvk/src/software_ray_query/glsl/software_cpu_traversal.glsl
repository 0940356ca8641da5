#ifndef LVK_SOFTWARE_CPU_TRAVERSAL_GLSL
#define LVK_SOFTWARE_CPU_TRAVERSAL_GLSL

// Part of <lvk/software_traversal.glsl>: traversal on CPUs for the most common case, a BVH8 of opaque triangles. A CPU
// runs eight invocations as one, and mispredicted branches cost most. So there are few branches, and the code after a
// test does not depend on its result. Each iteration does the work that most of the eight need.

// Additional values of a level.
struct LvkSoftTriangleLevel {
    LvkSoftItems nodes;
    LvkSoftItems triangles;
    LvkSoftOrder order;
    vec2 wholes; // a triangle counts if the sum of its areas is between these (face culling)
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

// The nearest triangle so far: its index, or LVK_SOFT_NONE, and the sum of its areas.
struct LvkSoftNearest {
    uint primitive;
    float whole;
};

// Tests the next triangle of the group, and commits a hit if `counts`. Returns true if the ray ends there. The data of
// the triangle's leaf is read once the nearest one is known.
bool lvkSoftTestTriangle(inout LvkSoftState state, inout LvkSoftCursor cursor, LvkSoftLevel level,
                         LvkSoftTriangleLevel triangles, bool counts, inout LvkSoftNearest nearest) {
    LVK_SOFT_COUNT_STEP();
    uint primitive = cursor.leaves.x + uint(findLSB(cursor.leaves.y));
    cursor.leaves.y &= cursor.leaves.y - 1u;
    vec3 vertices[3], lengths;
    uvec3 words;
    lvkSoftReadTriangle(lvkSoftItem(triangles.triangles, primitive, LVK_SOFT_TRIANGLE_BLOCKS), 0u, vertices, words);
    vec3 areas = lvkSoftAreas(level.shear, level.slabs.origin, vertices, lengths);
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

// Visits the next node of the group. The rest of the group is pushed only if the ray hits inner children of the node.
void lvkSoftVisitWide(inout LvkSoftCursor cursor, LvkSoftLevel level, LvkSoftTriangleLevel triangles, vec2 range) {
    LVK_SOFT_COUNT_STEP();
    uint node = lvkSoftTakeNode(cursor, level);
    uvec4 hits = lvkSoftIntersectNode(level.slabs, triangles.order,
                                      lvkSoftItem(triangles.nodes, node, LVK_SOFT_WIDE_NODE_BLOCKS), range);
    bool goesIn = hits.y >= LVK_SOFT_ANY_NODE;
    if (goesIn && cursor.group.y >= LVK_SOFT_ANY_NODE) {
        lvkSoftPushGroup(cursor.top, cursor.group);
    }
    cursor.group = goesIn ? hits.xy : cursor.group;
    cursor.leaves = hits.zw;
}

// Fills in the data of the hit.
void lvkSoftFillHit(inout LvkSoftHit hit, LvkSoftLevel level, LvkSoftItems triangles, uint instance,
                    LvkSoftNearest nearest) {
    vec3 vertices[3];
    uvec3 words;
    lvkSoftReadTriangle(lvkSoftItem(triangles, nearest.primitive, LVK_SOFT_TRIANGLE_BLOCKS), 0u, vertices, words);
    hit.kind = 1u;
    hit.instance = instance;
    hit.primitive = nearest.primitive;
    hit.front = lvkSoftIsFront(level.shear, nearest.whole) != level.flip;
    hit.numbers = lvkSoftNumbers(words, LVK_SOFT_TRIANGLES, level.several);
    hit.opaque = (words.z & 1u) != 0u;
}

// Traverses the BLAS of a level. An iteration tests up to two triangles, and visits a node if none is left. A ray that
// ends does so after the visit, because other invocations need the visit anyway.
void lvkSoftTraverseTriangles(inout LvkSoftState state, inout LvkSoftCursor cursor, LvkSoftLevel level) {
    LvkSoftTriangleLevel triangles = lvkSoftTriangleLevelOf(level);
    LvkSoftNearest nearest = LvkSoftNearest(LVK_SOFT_NONE, 0.0);
    bool ends = false;
    while (!ends) {
        if (cursor.leaves.y != 0u) {
            ends = lvkSoftTestTriangle(state, cursor, level, triangles, true, nearest);
        }
        if (cursor.leaves.y != 0u) {
            ends = lvkSoftTestTriangle(state, cursor, level, triangles, !ends, nearest) || ends;
        }
        if (cursor.leaves.y == 0u) {
            if (cursor.group.y < LVK_SOFT_ANY_NODE) {
                if (cursor.top == cursor.floor) {
                    break;
                }
                cursor.group = lvkSoftPopGroup(cursor.top);
            }
            // Tested again, so that CPUs skip the visit once all rays have ended.
            if (cursor.group.y >= LVK_SOFT_ANY_NODE) {
                lvkSoftVisitWide(cursor, level, triangles, vec2(state.tMin, state.committed.t));
            }
        }
    }
    if (nearest.primitive != LVK_SOFT_NONE) {
        lvkSoftFillHit(state.committed, level, triangles.triangles, cursor.instance, nearest);
    }
    if (ends) {
        lvkSoftFinish(cursor);
    }
    cursor.instance = LVK_SOFT_NONE;
}

#endif
