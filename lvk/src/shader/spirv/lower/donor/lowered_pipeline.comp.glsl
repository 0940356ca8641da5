// The part of a lowered ray tracing pipeline that is the same in all pipelines: the launch, the traversal, and the
// values of hits. `lvk/src/shader/spirv/lower` links the shaders of a pipeline with this module: it finds the names of
// variables and functions below, and writes new bodies of the functions without one.
layout(local_size_x = 64) in;

// False if no shader judges candidates, and rays tell no opaque geometries from others.
layout(constant_id = 0) const bool kLvkHasCandidates = true;
// False if no hit group has an intersection shader.
layout(constant_id = 1) const bool kLvkHasBoxes = true;
// Flags that all rays have, and flags that rays may have.
layout(constant_id = 2) const uint kLvkFlagsAlways = 0u;
layout(constant_id = 3) const uint kLvkFlagsPossible = 0xFFFFFFFFu;

#define LVK_LOWERED_PIPELINE
#define LVK_CANDIDATE_FUNCTION lvkJudgeCandidate
#include <lvk/ray_query.glsl>

// `Launch` of lower/mod.rs. The push constants of the application follow.
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer LvkLaunch {
    uvec3 size;
    uint unused;
    uvec2 rayGen;
    uvec2 miss;
    uvec2 hit;
    uvec2 callable;
    uint pushConstants[];
};
layout(push_constant) uniform LvkPush { uvec2 launch; } lvkPush;

// The launch.
uvec3 lvkLaunchId;
uvec3 lvkLaunchSize;
uvec2 lvkPushConstants;
uvec2 lvkRayGenRecord;
uvec2 lvkMissRecords;
uvec2 lvkHitRecords;
uvec2 lvkCallableRecords;

// Arguments of the trace.
uint lvkRayTlas;
uint lvkRayFlags;
uint lvkRayMask;
uint lvkRayOffset;
uint lvkRayStride;
uint lvkRayMiss;
vec3 lvkRayOrigin;
float lvkRayTMin;
vec3 lvkRayDirection;
float lvkRayTMax;

// The candidate that a shader judges, or the closest hit.
bool lvkIsHit;
uint lvkHitGroup;
float lvkHitT;
uint lvkHitKind;
int lvkHitInstance;
int lvkHitCustomIndex;
int lvkHitGeometry;
int lvkHitPrimitive;
vec2 lvkHitBarycentrics;
vec3 lvkHitObjectOrigin;
vec3 lvkHitObjectDirection;
mat4x3 lvkHitObjectToWorld;
mat4x3 lvkHitWorldToObject;
vec3 lvkHitPositions[3];

// Results of shaders that judge the candidate.
bool lvkIgnores;
bool lvkEnds; // no other hit can follow
bool lvkUnwinds; // the shader ends, whatever its functions have left to do
bool lvkIsOpaque;
bool lvkIsGenerated;
uint lvkGeneratedKind;
float lvkLimit; // distance of the closest hit so far

// Runs the any-hit shader of lvkHitGroup, and sets lvkIgnores and lvkEnds.
void lvkCallAnyHit() { lvkIgnores = false; }
// Runs the intersection shader of lvkHitGroup.
void lvkCallIntersection() { lvkIsGenerated = false; }
// Copies the attributes of the candidate to those of the closest hit.
void lvkCommitAttributes() { lvkLimit = lvkHitT; }

// Vulkan's ids of a hit. The library's own traversal has only those of the application, which are the same to shaders:
// the linked shaders see no hit remap table then.
#ifdef LVK_SOFTWARE_RAY_QUERY
#define LVK_HIT_INSTANCE(rq, which) lvkRayQueryInstanceId(rq, which, 0u)
#define LVK_HIT_PRIMITIVE(rq, which) lvkRayQueryPrimitiveIndex(rq, which, 0u)
#else
#define LVK_HIT_INSTANCE(rq, which) rayQueryGetIntersectionInstanceIdEXT(rq, which)
#define LVK_HIT_PRIMITIVE(rq, which) rayQueryGetIntersectionPrimitiveIndexEXT(rq, which)
#endif

#define LVK_FILL(rq, which) \
    lvkHitT = lvkRayQueryT(rq, which); \
    lvkHitInstance = LVK_HIT_INSTANCE(rq, which); \
    lvkHitCustomIndex = lvkRayQueryInstanceCustomIndex(rq, which); \
    lvkHitGeometry = lvkRayQueryGeometryIndex(rq, which); \
    lvkHitPrimitive = LVK_HIT_PRIMITIVE(rq, which); \
    lvkHitGroup = lvkRayQueryInstanceShaderBindingTableRecordOffset(rq, which) + (lvkRayOffset & 15u) \
        + uint(lvkHitGeometry) * (lvkRayStride & 15u)

#define LVK_FILL_OBJECT_RAY(rq, which) \
    lvkHitObjectOrigin = lvkRayQueryObjectRayOrigin(rq, which); \
    lvkHitObjectDirection = lvkRayQueryObjectRayDirection(rq, which)

#define LVK_FILL_MATRICES(rq, which) \
    lvkHitObjectToWorld = lvkRayQueryObjectToWorld(rq, which); \
    lvkHitWorldToObject = lvkRayQueryWorldToObject(rq, which)

#define LVK_FILL_TRIANGLE(rq, which) \
    lvkHitBarycentrics = lvkRayQueryBarycentrics(rq, which); \
    lvkHitKind = lvkRayQueryFrontFace(rq, which) ? 0xFEu : 0xFFu

// Functions that are emptied if no shader reads the values.
void lvkCandidateObjectRay(LvkRayQueryParameter rq) { LVK_FILL_OBJECT_RAY(rq, LVK_CANDIDATE); }
void lvkCommittedObjectRay(LvkRayQueryParameter rq) { LVK_FILL_OBJECT_RAY(rq, LVK_COMMITTED); }
void lvkCandidateMatrices(LvkRayQueryParameter rq) { LVK_FILL_MATRICES(rq, LVK_CANDIDATE); }
void lvkCommittedMatrices(LvkRayQueryParameter rq) { LVK_FILL_MATRICES(rq, LVK_COMMITTED); }
void lvkCandidatePositions(LvkRayQueryParameter rq) {
    lvkRayQueryTriangleVertexPositions(rq, LVK_CANDIDATE, lvkHitPositions);
}
void lvkCommittedPositions(LvkRayQueryParameter rq) {
    lvkRayQueryTriangleVertexPositions(rq, LVK_COMMITTED, lvkHitPositions);
}

// Reports a hit at distance `t` from an intersection shader. True if the hit is the closest so far.
bool lvkReport(const float t, const uint kind) {
    if (!(t >= lvkRayTMin && t <= lvkLimit)) {
        return false;
    }
    lvkHitT = t;
    lvkHitKind = kind;
    lvkIgnores = false;
    if (!lvkIsOpaque) {
        lvkCallAnyHit();
        lvkUnwinds = lvkEnds;
    }
    if (lvkIgnores) {
        return false;
    }
    lvkLimit = t;
    lvkIsGenerated = true;
    lvkGeneratedKind = kind;
    lvkCommitAttributes();
    if ((lvkRayFlags & LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT) != 0u) {
        lvkEnds = true;
        lvkUnwinds = true;
    }
    return true;
}

void lvkJudgeTriangle(LvkRayQueryParameter rq) {
    LVK_FILL_TRIANGLE(rq, LVK_CANDIDATE);
    lvkCandidatePositions(rq);
    lvkIgnores = false;
    lvkCallAnyHit();
    if (!lvkIgnores) {
        lvkRayQueryConfirmIntersection(rq);
    }
}

void lvkJudgeBox(LvkRayQueryParameter rq) {
    lvkIsOpaque = lvkRayQueryCandidateAABBOpaque(rq);
    bool isFirst = lvkRayQueryType(rq, LVK_COMMITTED) == LVK_COMMITTED_NONE;
    lvkLimit = isFirst ? lvkRayTMax : lvkRayQueryT(rq, LVK_COMMITTED);
    lvkIsGenerated = false;
    lvkCallIntersection();
    if (lvkIsGenerated) {
        lvkRayQueryGenerateIntersection(rq, lvkLimit);
    }
}

void lvkJudgeCandidate(LvkRayQueryParameter rq) {
    if (!kLvkHasCandidates) {
        return;
    }
    LVK_FILL(rq, LVK_CANDIDATE);
    lvkCandidateObjectRay(rq);
    lvkCandidateMatrices(rq);
    lvkEnds = false;
    lvkUnwinds = false;
    if (lvkRayQueryType(rq, LVK_CANDIDATE) == LVK_CANDIDATE_AABB) {
        if (kLvkHasBoxes) {
            lvkJudgeBox(rq);
        }
    } else {
        lvkJudgeTriangle(rq);
    }
    if (lvkEnds) {
        lvkRayQueryTerminate(rq);
    }
}

// Traces the ray.
void lvkTraverse() {
    LvkRayQuery rq;
    uint flags = lvkRayFlags & kLvkFlagsPossible & ~LVK_RAY_FLAG_SKIP_CLOSEST_HIT_SHADER | kLvkFlagsAlways;
    lvkRayQueryInitialize(rq, lvkRayTlas, flags, lvkRayMask & 0xFFu, lvkRayOrigin, lvkRayTMin, lvkRayDirection,
                          lvkRayTMax);
    while (lvkRayQueryProceed(rq)) {
    }
    uint type = lvkRayQueryType(rq, LVK_COMMITTED);
    lvkIsHit = type != LVK_COMMITTED_NONE;
    if (!lvkIsHit) {
        return;
    }
    LVK_FILL(rq, LVK_COMMITTED);
    lvkCommittedObjectRay(rq);
    lvkCommittedMatrices(rq);
    if (kLvkHasBoxes && type == LVK_COMMITTED_GENERATED) {
        lvkHitKind = lvkGeneratedKind;
    } else {
        LVK_FILL_TRIANGLE(rq, LVK_COMMITTED);
        lvkCommittedPositions(rq);
    }
}

// Returns the address of record `index` of a region.
uvec2 lvkRecordAddress(const uvec2 region, const uint index, const uint stride) {
    uint carry;
    uint low = uaddCarry(region.x, index * stride, carry);
    return uvec2(low, region.y + carry);
}

#ifdef LVK_DEVICE_IS_CPU
// Eight invocations run at once: their rays make blocks of 4 x 2, which keep closer together than those of a row.
uvec2 lvkPlaceInGroup(const uint local) {
    uint place = local >> 3;
    return uvec2(place & 1u, place >> 1) * uvec2(4u, 2u) + uvec2(local & 3u, local >> 2 & 1u);
}

// Each thread of lavapipe takes a run of workgroups: so a run has rows from all over the launch, and none the costly
// half. First come rows whose numbers are multiples of 4, then those 2 beyond, 1 beyond and 3.
uint lvkGroupRow() {
    const uint beyond[4] = uint[](0u, 2u, 1u, 3u);
    uint row = 0u;
    uint begin = 0u;
    [[unroll]] for (uint i = 0u; i < 4u; ++i) {
        row = gl_WorkGroupID.y >= begin ? (gl_WorkGroupID.y - begin) * 4u + beyond[i] : row;
        begin += (gl_NumWorkGroups.y + 3u - beyond[i]) / 4u;
    }
    return row;
}
#else
uvec2 lvkPlaceInGroup(const uint local) { return uvec2(local & 7u, local >> 3); }
uint lvkGroupRow() { return gl_WorkGroupID.y; }
#endif

// Finds the invocation's place in the launch. False if the place lies outside.
bool lvkStart() {
    LvkLaunch launch = LvkLaunch(lvkPush.launch);
    lvkLaunchSize = launch.size;
    lvkRayGenRecord = launch.rayGen;
    lvkMissRecords = launch.miss;
    lvkHitRecords = launch.hit;
    lvkCallableRecords = launch.callable;
    lvkPushConstants = lvkRecordAddress(lvkPush.launch, 1u, 48u);
    uint local = gl_LocalInvocationIndex;
    if (lvkLaunchSize.y == 1u && lvkLaunchSize.z == 1u) {
        uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
        lvkLaunchId = uvec3(group * 64u + local, 0u, 0u);
    } else {
        uvec2 group = uvec2(gl_WorkGroupID.x, lvkGroupRow());
        lvkLaunchId = uvec3(group * 8u + lvkPlaceInGroup(local), gl_WorkGroupID.z);
    }
    return all(lessThan(lvkLaunchId, lvkLaunchSize));
}

void main() {
    if (lvkStart()) {
        lvkTraverse();
        if (kLvkHasBoxes) {
            lvkReport(lvkRayTMax, 0u);
        }
    }
}
