// Every value that a query reports of its ray, of the closest hit and of the last candidate. Triangles with odd numbers are
// ignored unless they are opaque. OPAQUE_ONLY is a module without candidates. OF_MISSES reads the values of a hit whether
// there is one or not, and stores the sum of the triangle's vertices as the origin in the candidate's space.
#ifdef OPAQUE_ONLY
#define LVK_OPAQUE_TRIANGLES_ONLY
#endif
#include "ray_query_start.glsl"

struct Found {
    HitRecord hit;
    uint type;
    uint sbtOffset;
    vec3 objectOrigin;
    vec3 objectDirection;
    mat4x3 objectToWorld;
    mat4x3 worldToObject;
};

struct Told {
    uint flags;
    float tMin;
    vec3 origin;
    vec3 direction;
    Found committed;
    Found candidate;
};

layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer AllTold {
    Told at[];
};

#define FOUND(rq, which) \
    Found(HitRecord(lvkRayQueryT(rq, which), lvkRayQueryBarycentrics(rq, which), \
                    lvkRayQueryFrontFace(rq, which) ? kFront : kBack, \
                    uint(lvkRayQueryInstanceId(rq, which, tlas)), uint(lvkRayQueryInstanceCustomIndex(rq, which)), \
                    uint(lvkRayQueryGeometryIndex(rq, which)), uint(lvkRayQueryPrimitiveIndex(rq, which, tlas))), \
          uint(lvkRayQueryType(rq, which)), uint(lvkRayQueryInstanceShaderBindingTableRecordOffset(rq, which)), \
          lvkRayQueryObjectRayOrigin(rq, which), lvkRayQueryObjectRayDirection(rq, which), \
          lvkRayQueryObjectToWorld(rq, which), lvkRayQueryWorldToObject(rq, which))

void main() {
    START_RAY_QUERY;
    Found none = Found(kNoHit, 0u, 0u, vec3(0.0), vec3(0.0), mat4x3(0.0), mat4x3(0.0));
    Found committed = none;
    Found candidate = none;
    while (lvkRayQueryProceed(rq)) {
        candidate = FOUND(rq, LVK_CANDIDATE);
        if ((candidate.hit.primitive & 1u) == 0u) {
            lvkRayQueryConfirmIntersection(rq);
        }
    }
#ifdef OF_MISSES
    committed = FOUND(rq, LVK_COMMITTED);
    candidate = FOUND(rq, LVK_CANDIDATE);
#ifdef LVK_POSITION_FETCH
    vec3 corners[3];
    lvkRayQueryTriangleVertexPositions(rq, LVK_COMMITTED, corners);
    candidate.objectOrigin = abs(corners[0]) + abs(corners[1]) + abs(corners[2]);
#endif
#else
    if (lvkRayQueryType(rq, LVK_COMMITTED) == LVK_COMMITTED_TRIANGLE) {
        committed = FOUND(rq, LVK_COMMITTED);
    }
#endif
    AllTold told = AllTold(uvec2(hits));
    told.at[index] = Told(lvkRayQueryRayFlags(rq), lvkRayQueryRayTMin(rq), lvkRayQueryWorldRayOrigin(rq),
                          lvkRayQueryWorldRayDirection(rq), committed, candidate);
}
