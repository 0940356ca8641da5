#ifndef LVK_HARDWARE_RAY_QUERY_GLSL
#define LVK_HARDWARE_RAY_QUERY_GLSL

// Part of <lvk/ray_query.glsl>: queries by rayQueryEXT.

#extension GL_EXT_ray_query : require
#ifdef LVK_POSITION_FETCH
#extension GL_EXT_ray_tracing_position_fetch : require
#endif
#include <lvk/hit_remap.glsl>
#include <lvk/tlas.glsl>

#define LvkRayQuery rayQueryEXT
#define LvkRayQueryParameter rayQueryEXT

#ifdef LVK_CANDIDATE_FUNCTION
void LVK_CANDIDATE_FUNCTION(LvkRayQueryParameter rq);

// Traverses to the end, and calls the function of the module for each candidate. Returns false.
bool lvkJudgeCandidates(LvkRayQueryParameter rq) {
    while (rayQueryProceedEXT(rq)) {
        LVK_CANDIDATE_FUNCTION(rq);
    }
    return false;
}
#endif

// Starts a query: void (LvkRayQuery, uint tlasIndex, uint flags, uint cullMask, vec3 origin, float tMin, vec3 direction, float tMax).
#define lvkRayQueryInitialize(rq, tlasIndex, flags, mask, origin, tMin, direction, tMax) \
    rayQueryInitializeEXT(rq, kTLAS[nonuniformEXT(tlasIndex)], (flags) | LVK_RAY_FLAGS_ALWAYS, mask, origin, tMin, direction, tMax)
// Steps to the next candidate that the shader must judge; false when the traversal is over.
#ifndef LVK_CANDIDATE_FUNCTION
#define lvkRayQueryProceed(rq) rayQueryProceedEXT(rq)
#else
#define lvkRayQueryProceed(rq) lvkJudgeCandidates(rq)
#endif
// Ends the traversal; the committed hit stays.
#define lvkRayQueryTerminate(rq) rayQueryTerminateEXT(rq)
// Commits the candidate AABB at distance `t`, within the remaining range.
#define lvkRayQueryGenerateIntersection(rq, t) rayQueryGenerateIntersectionEXT(rq, t)
// Commits the candidate triangle.
#define lvkRayQueryConfirmIntersection(rq) rayQueryConfirmIntersectionEXT(rq)

// Values of the ray.
#define lvkRayQueryRayTMin(rq) rayQueryGetRayTMinEXT(rq)
#define lvkRayQueryRayFlags(rq) uint(rayQueryGetRayFlagsEXT(rq))
#define lvkRayQueryWorldRayOrigin(rq) rayQueryGetWorldRayOriginEXT(rq)
#define lvkRayQueryWorldRayDirection(rq) rayQueryGetWorldRayDirectionEXT(rq)

// Values of an intersection.
#define lvkRayQueryType(rq, which) rayQueryGetIntersectionTypeEXT(rq, which)
#define lvkRayQueryT(rq, which) rayQueryGetIntersectionTEXT(rq, which)
// The application's own instance and primitive ids; `tlas` is the index that the query was started with.
#define lvkRayQueryInstanceId(rq, which, tlas) lvkMapInstance(tlas, rayQueryGetIntersectionInstanceIdEXT(rq, which))
#define lvkRayQueryPrimitiveIndex(rq, which, tlas) \
    lvkMapPrimitive(tlas, rayQueryGetIntersectionInstanceIdEXT(rq, which), \
        rayQueryGetIntersectionGeometryIndexEXT(rq, which), rayQueryGetIntersectionPrimitiveIndexEXT(rq, which))
#define lvkRayQueryInstanceCustomIndex(rq, which) rayQueryGetIntersectionInstanceCustomIndexEXT(rq, which)
#define lvkRayQueryInstanceShaderBindingTableRecordOffset(rq, which) \
    rayQueryGetIntersectionInstanceShaderBindingTableRecordOffsetEXT(rq, which)
#define lvkRayQueryGeometryIndex(rq, which) rayQueryGetIntersectionGeometryIndexEXT(rq, which)
#define lvkRayQueryBarycentrics(rq, which) rayQueryGetIntersectionBarycentricsEXT(rq, which)
#define lvkRayQueryFrontFace(rq, which) rayQueryGetIntersectionFrontFaceEXT(rq, which)
#ifdef LVK_POSITION_FETCH
// Vertices of the triangle, in object space: void (LvkRayQuery, which, out vec3[3]). Needs BuildFlags::POSITION_FETCH.
#define lvkRayQueryTriangleVertexPositions(rq, which, positions) \
    rayQueryGetIntersectionTriangleVertexPositionsEXT(rq, which, positions)
#endif
#define lvkRayQueryCandidateAABBOpaque(rq) rayQueryGetIntersectionCandidateAABBOpaqueEXT(rq)
#define lvkRayQueryObjectRayOrigin(rq, which) rayQueryGetIntersectionObjectRayOriginEXT(rq, which)
#define lvkRayQueryObjectRayDirection(rq, which) rayQueryGetIntersectionObjectRayDirectionEXT(rq, which)
#define lvkRayQueryObjectToWorld(rq, which) rayQueryGetIntersectionObjectToWorldEXT(rq, which)
#define lvkRayQueryWorldToObject(rq, which) rayQueryGetIntersectionWorldToObjectEXT(rq, which)

#endif
