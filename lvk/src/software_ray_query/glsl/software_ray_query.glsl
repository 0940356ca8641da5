#ifndef LVK_SOFTWARE_RAY_QUERY_GLSL
#define LVK_SOFTWARE_RAY_QUERY_GLSL

// Part of <lvk/ray_query.glsl>: queries with software traversal, for devices without ray queries or with slow ones.
#include <lvk/software_traversal.glsl>
#include <lvk/tlas_table.glsl>

// A query: its state, and its stack entries while it waits with a candidate, if queries of the module ever wait.
#if defined(LVK_OPAQUE_TRIANGLES_ONLY) || defined(LVK_CANDIDATE_FUNCTION)
#define LVK_SOFT_NEVER_WAITS
struct LvkRayQuery {
    LvkSoftState state;
};
#else
struct LvkRayQuery {
    LvkSoftState state;
    uvec2 stack[LVK_SOFT_STACK_ENTRIES];
};
#endif

#define LvkRayQueryParameter inout LvkRayQuery

#ifdef LVK_CANDIDATE_FUNCTION
void LVK_CANDIDATE_FUNCTION(LvkRayQueryParameter rq);

void lvkSoftCallCandidateFunction(inout LvkSoftState state) {
    LvkRayQuery rq = LvkRayQuery(state);
    LVK_CANDIDATE_FUNCTION(rq);
    state = rq.state;
}
#endif

void lvkSoftInitialize(out LvkSoftState state, uint tlas, uint flags, uint mask, vec3 origin, float tMin,
                       vec3 direction, float tMax) {
    LvkSoftHit none = lvkSoftNoHit(tMax);
    LvkSoftCursor start;
    lvkSoftFinish(start);
    lvkSoftQueries += 1u;
    flags |= LVK_RAY_FLAGS_ALWAYS;
    // A NaN stays NaN, whatever its sign: no distance is beyond it.
    bool isNumber = (floatBitsToUint(tMin) & 0x7FFFFFFFu) <= 0x7F800000u;
    float from = intBitsToFloat(isNumber ? max(floatBitsToInt(tMin), 0) : 0x7FC00000);
    state = LvkSoftState(kLvkTlasTable.entry[tlas].software, origin, from, direction, flags, mask & 0xFFu,
                         lvkSoftQueries, false, start, none, none);
    if (state.tlas != uvec2(0u)) {
        state.cursor.next = LvkSoftBlocks(state.tlas).at[0].z;
    }
}

// Saves the stack while the shader judges a candidate.
bool lvkSoftSave(LvkSoftState state, inout uvec2 stack[LVK_SOFT_STACK_ENTRIES]) {
    for (uint entry = 0u; entry < lvkSoftEntries(state.cursor.top); ++entry) {
        stack[entry] = lvkSoftStack[entry];
    }
    return true;
}

// Restores the stack, which another query has used meanwhile.
bool lvkSoftRestore(LvkSoftState state, uvec2 stack[LVK_SOFT_STACK_ENTRIES]) {
    for (uint entry = 0u; entry < lvkSoftEntries(state.cursor.top); ++entry) {
        lvkSoftStack[entry] = stack[entry];
    }
    return true;
}

void lvkSoftJudge(inout LvkSoftState state, uint kind) {
    LvkSoftCursor cursor = state.cursor;
    lvkSoftCommit(state, cursor, state.candidate, kind);
    state.cursor = cursor;
}

void lvkSoftConfirm(inout LvkSoftState state) {
    lvkSoftJudge(state, 1u);
}

void lvkSoftGenerate(inout LvkSoftState state, float t) {
    if (t >= state.tMin && t <= state.committed.t) {
        state.candidate.t = t;
        lvkSoftJudge(state, 2u);
    }
}

// Returns zeros without a hit: LVK_SOFT_NONE is no index of an instance, and no valid memory.
uvec4 lvkSoftInstanceBlock(LvkSoftState state, uint instance, uint block) {
    if (instance == LVK_SOFT_NONE) {
        return uvec4(0u);
    }
    return LvkSoftBlocks(lvkSoftInstances(state)).at[instance * LVK_SOFT_INSTANCE_BLOCKS + block];
}

// Returns the rows of the instance's matrix in its blocks from `first` on; zeros without a hit.
mat3x4 lvkSoftInstanceRows(LvkSoftState state, LvkSoftHit hit, uint first) {
    if (hit.instance == LVK_SOFT_NONE) {
        return mat3x4(0.0);
    }
    return lvkSoftRows(lvkSoftInstances(state), hit.instance * LVK_SOFT_INSTANCE_BLOCKS + first);
}

vec3 lvkSoftObject(LvkSoftState state, LvkSoftHit hit, vec4 v) {
    return lvkSoftTransform(lvkSoftInstanceRows(state, hit, 0u), v);
}

// Returns the matrix in the instance's blocks from `first` on.
mat4x3 lvkSoftMatrix(LvkSoftState state, LvkSoftHit hit, uint first) {
    return transpose(lvkSoftInstanceRows(state, hit, first));
}

// Returns the vertices of the hit triangle; zeros without a triangle.
void lvkSoftPositions(LvkSoftState state, LvkSoftHit hit, out vec3 positions[3]) {
    positions = vec3[3](vec3(0.0), vec3(0.0), vec3(0.0));
    if (hit.instance == LVK_SOFT_NONE) {
        return;
    }
    uvec4 head;
    uvec2 structure = lvkSoftStructureOf(lvkSoftInstanceBlock(state, hit.instance, 6u).xy, head);
    if (head.y == LVK_SOFT_BOXES) {
        return;
    }
    uint primitives = LvkSoftBlocks(structure).at[1].y;
    uvec3 words;
    lvkSoftReadVertices(structure, primitives, head.y, hit.primitive, positions, words);
}

// The hit that `which` selects.
#define LVK_SOFT_HIT(rq, which) ((which) ? (rq).state.committed : (rq).state.candidate)

// Starts a query: void (LvkRayQuery, uint tlasIndex, uint flags, uint cullMask, vec3 origin, float tMin, vec3 direction, float tMax).
#define lvkRayQueryInitialize(rq, tlasIndex, flags, mask, origin, tMin, direction, tMax) \
    lvkSoftInitialize((rq).state, tlasIndex, flags, mask, origin, tMin, direction, tMax)
// Steps to the next candidate that the shader must judge; false when the traversal is over.
#ifdef LVK_SOFT_NEVER_WAITS
#define lvkRayQueryProceed(rq) lvkSoftProceed((rq).state)
#else
#define lvkRayQueryProceed(rq) \
    ((!(rq).state.interrupted || lvkSoftOwner == (rq).state.id || lvkSoftRestore((rq).state, (rq).stack)) \
        && lvkSoftProceed((rq).state) && lvkSoftSave((rq).state, (rq).stack))
#endif
// Ends the traversal; the committed hit stays.
#define lvkRayQueryTerminate(rq) lvkSoftFinish((rq).state.cursor)
// Commits the candidate AABB at distance `t`, within the remaining range.
#define lvkRayQueryGenerateIntersection(rq, t) lvkSoftGenerate((rq).state, t)
// Commits the candidate triangle.
#define lvkRayQueryConfirmIntersection(rq) lvkSoftConfirm((rq).state)

// Values of the ray.
#define lvkRayQueryRayTMin(rq) ((rq).state.tMin)
#define lvkRayQueryRayFlags(rq) ((rq).state.flags)
#define lvkRayQueryWorldRayOrigin(rq) ((rq).state.origin)
#define lvkRayQueryWorldRayDirection(rq) ((rq).state.direction)

// Values of an intersection.
#define lvkRayQueryType(rq, which) (LVK_SOFT_HIT(rq, which).kind)
#define lvkRayQueryT(rq, which) (LVK_SOFT_HIT(rq, which).t)
// The application's own ids of instance and primitive; `tlas` is the index that the query was started with.
#define lvkRayQueryInstanceId(rq, which, tlas) \
    int(lvkSoftInstanceBlock((rq).state, LVK_SOFT_HIT(rq, which).instance, 7u).x)
#define lvkRayQueryPrimitiveIndex(rq, which, tlas) int(LVK_SOFT_HIT(rq, which).numbers.y)
#define lvkRayQueryInstanceCustomIndex(rq, which) \
    int(lvkSoftInstanceBlock((rq).state, LVK_SOFT_HIT(rq, which).instance, 6u).z & 0x00FFFFFFu)
#define lvkRayQueryInstanceShaderBindingTableRecordOffset(rq, which) \
    (lvkSoftInstanceBlock((rq).state, LVK_SOFT_HIT(rq, which).instance, 6u).w & 0x00FFFFFFu)
#define lvkRayQueryGeometryIndex(rq, which) int(LVK_SOFT_HIT(rq, which).numbers.x)
#define lvkRayQueryBarycentrics(rq, which) (LVK_SOFT_HIT(rq, which).barycentrics)
#define lvkRayQueryFrontFace(rq, which) (LVK_SOFT_HIT(rq, which).front)
#ifdef LVK_POSITION_FETCH
// Vertices of the triangle, in object space: void (LvkRayQuery, which, out vec3[3]). Needs BuildFlags::POSITION_FETCH.
#define lvkRayQueryTriangleVertexPositions(rq, which, positions) \
    lvkSoftPositions((rq).state, LVK_SOFT_HIT(rq, which), positions)
#endif
#define lvkRayQueryCandidateAABBOpaque(rq) ((rq).state.candidate.opaque)
#define lvkRayQueryObjectRayOrigin(rq, which) \
    lvkSoftObject((rq).state, LVK_SOFT_HIT(rq, which), vec4((rq).state.origin, 1.0))
#define lvkRayQueryObjectRayDirection(rq, which) \
    lvkSoftObject((rq).state, LVK_SOFT_HIT(rq, which), vec4((rq).state.direction, 0.0))
#define lvkRayQueryObjectToWorld(rq, which) lvkSoftMatrix((rq).state, LVK_SOFT_HIT(rq, which), 3u)
#define lvkRayQueryWorldToObject(rq, which) lvkSoftMatrix((rq).state, LVK_SOFT_HIT(rq, which), 0u)

#endif
