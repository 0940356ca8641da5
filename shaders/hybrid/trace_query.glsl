// traceClosest() and traceOccluded() by ray queries.
#ifndef HYBRID_TRACE_QUERY
#define HYBRID_TRACE_QUERY

#define LVK_OPAQUE_TRIANGLES_ONLY
#include <lvk/ray_query.glsl>

#include "common/occlusion_query.glsl"
#include "hybrid/frame.glsl"
#include "hybrid/hit.glsl"

Hit traceClosest(vec3 origin, float tmin, vec3 direction, float tmax) {
    LvkRayQuery query;
    lvkRayQueryInitialize(query, frame.tlas, LVK_RAY_FLAG_OPAQUE, kMaskAll, origin, tmin, direction, tmax);
    while (lvkRayQueryProceed(query)) {
    }
    Hit hit = Hit(kNoTriangle, vec2(0.0));
    if (lvkRayQueryType(query, LVK_COMMITTED) != LVK_COMMITTED_NONE) {
        uint firstTriangle = uint(lvkRayQueryInstanceCustomIndex(query, LVK_COMMITTED));
        hit.triangle = firstTriangle + uint(lvkRayQueryPrimitiveIndex(query, LVK_COMMITTED, frame.tlas));
        hit.barycentrics = lvkRayQueryBarycentrics(query, LVK_COMMITTED);
    }
    return hit;
}

bool traceOccluded(vec3 origin, float tmin, vec3 direction, float tmax) {
    return occludedByQuery(frame.tlas, kMaskOpaque, origin, tmin, direction, tmax);
}

#endif
