// traceClosest() and traceBlocker() by ray queries. A candidate is a leaf: nothing else is not opaque.
#ifndef REFLECTIONS_TRACE_QUERY
#define REFLECTIONS_TRACE_QUERY

#define LVK_TRIANGLES_ONLY
#define LVK_CANDIDATE_FUNCTION confirmSolid
#include <lvk/ray_query.glsl>

#include "reflections/masks.glsl"
#include "reflections/surface.glsl"

void confirmSolid(LvkRayQueryParameter query) {
    uint instance = uint(lvkRayQueryInstanceCustomIndex(query, LVK_CANDIDATE));
    uint geometry = uint(lvkRayQueryGeometryIndex(query, LVK_CANDIDATE));
    uint primitive = uint(lvkRayQueryPrimitiveIndex(query, LVK_CANDIDATE, frame.tlas));
    if (isSolid(instance, geometry, primitive, lvkRayQueryBarycentrics(query, LVK_CANDIDATE))) {
        lvkRayQueryConfirmIntersection(query);
    }
}

Hit traceClosest(vec3 origin, vec3 direction, float range) {
    LvkRayQuery query;
    lvkRayQueryInitialize(query, frame.tlas, LVK_RAY_FLAG_NONE, kMaskAll, origin, 0.0, direction, range);
    while (lvkRayQueryProceed(query)) {
    }
    Hit hit = Hit(kNothing, 0u, 0u, vec2(0.0), 0.0);
    if (lvkRayQueryType(query, LVK_COMMITTED) != LVK_COMMITTED_NONE) {
        hit.instance = uint(lvkRayQueryInstanceCustomIndex(query, LVK_COMMITTED));
        hit.geometry = uint(lvkRayQueryGeometryIndex(query, LVK_COMMITTED));
        hit.primitive = uint(lvkRayQueryPrimitiveIndex(query, LVK_COMMITTED, frame.tlas));
        hit.barycentrics = lvkRayQueryBarycentrics(query, LVK_COMMITTED);
        hit.distance = lvkRayQueryT(query, LVK_COMMITTED);
    }
    return hit;
}

// Distance of what blocks the way, the nearest unless `flags` end the ray before; below 0 where nothing does.
float traceBlocker(vec3 origin, vec3 direction, float range, uint flags) {
    LvkRayQuery query;
    lvkRayQueryInitialize(query, frame.tlas, flags, kMaskOpaque, origin, 0.0, direction, range);
    while (lvkRayQueryProceed(query)) {
    }
    bool isBlocked = lvkRayQueryType(query, LVK_COMMITTED) != LVK_COMMITTED_NONE;
    return isBlocked ? lvkRayQueryT(query, LVK_COMMITTED) : -1.0;
}

#endif
