// traceWithin() and transmittanceTo() by ray queries. What is not opaque is judged as the any-hit shader does.
#ifndef VIEWER_TRACE_QUERY
#define VIEWER_TRACE_QUERY

#define LVK_TRIANGLES_ONLY
#define LVK_CANDIDATE_FUNCTION judgeCandidate
#include <lvk/ray_query.glsl>

#include "viewer/candidate.glsl"

// Of the ray under way.
Payload payload;

void judgeCandidate(LvkRayQueryParameter query) {
    Hit hit;
    hit.instance = uint(lvkRayQueryInstanceCustomIndex(query, LVK_CANDIDATE));
    hit.geometry = uint(lvkRayQueryGeometryIndex(query, LVK_CANDIDATE));
    hit.primitive = uint(lvkRayQueryPrimitiveIndex(query, LVK_CANDIDATE, frame.tlas));
    hit.barycentrics = lvkRayQueryBarycentrics(query, LVK_CANDIDATE);
    hit.distance = lvkRayQueryT(query, LVK_CANDIDATE);
    if (!passesThrough(hit, lvkRayQueryWorldRayDirection(query), payload)) {
        lvkRayQueryConfirmIntersection(query);
    }
}

// The nearest surface up to `range` away, at the distance `range` where there is none. `flags`: of the ray.
Hit traceWithin(vec3 origin, vec3 direction, float range, uint seed, uint flags) {
    payload.seed = seed;
    LvkRayQuery query;
    lvkRayQueryInitialize(query, frame.tlas, flags, 0xffu, origin, 0.0, direction, range);
    while (lvkRayQueryProceed(query)) {
    }
    Hit hit = Hit(kNothing, 0u, 0u, vec2(0.0), range);
    if (lvkRayQueryType(query, LVK_COMMITTED) != LVK_COMMITTED_NONE) {
        hit.instance = uint(lvkRayQueryInstanceCustomIndex(query, LVK_COMMITTED));
        hit.geometry = uint(lvkRayQueryGeometryIndex(query, LVK_COMMITTED));
        hit.primitive = uint(lvkRayQueryPrimitiveIndex(query, LVK_COMMITTED, frame.tlas));
        hit.barycentrics = lvkRayQueryBarycentrics(query, LVK_COMMITTED);
        hit.distance = lvkRayQueryT(query, LVK_COMMITTED);
    }
    return hit;
}

// The share of light that comes from `range` away: 0 where something opaque is between.
vec3 transmittanceTo(vec3 origin, vec3 direction, float range) {
    payload.seed = kShadow;
    payload.transmittance = vec3(1.0);
    LvkRayQuery query;
    lvkRayQueryInitialize(query, frame.tlas, LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT, 0xffu, origin, 0.0, direction, range);
    while (lvkRayQueryProceed(query)) {
    }
    return lvkRayQueryType(query, LVK_COMMITTED) == LVK_COMMITTED_NONE ? payload.transmittance : vec3(0.0);
}

#endif
