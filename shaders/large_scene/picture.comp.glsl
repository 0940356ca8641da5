// A pixel by ray queries.
#define LVK_OPAQUE_TRIANGLES_ONLY
#include <lvk/ray_query.glsl>

#include "common/group_pixel.glsl"
#include "large_scene/frame.glsl"
#include "large_scene/hit.glsl"

Hit traceNearest(uint mask, vec3 origin, vec3 direction, float tmax) {
    LvkRayQuery query;
    lvkRayQueryInitialize(query, frame.tlas, LVK_RAY_FLAG_OPAQUE, mask, origin, 0.0, direction, tmax);
    while (lvkRayQueryProceed(query)) {
    }
    Hit hit = Hit(kNothing, 0u, vec2(0.0));
    if (lvkRayQueryType(query, LVK_COMMITTED) != LVK_COMMITTED_NONE) {
        uint first = frame.firsts.at[lvkRayQueryInstanceCustomIndex(query, LVK_COMMITTED)];
        hit.triangle = first + uint(lvkRayQueryPrimitiveIndex(query, LVK_COMMITTED, frame.tlas));
        hit.instance = uint(lvkRayQueryInstanceId(query, LVK_COMMITTED, frame.tlas));
        hit.barycentrics = lvkRayQueryBarycentrics(query, LVK_COMMITTED);
    }
    return hit;
}

bool occludedBy(uint mask, vec3 origin, float tmin, vec3 direction, float tmax) {
    LvkRayQuery query;
    const uint flags = LVK_RAY_FLAG_OPAQUE | LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT;
    lvkRayQueryInitialize(query, frame.tlas, flags, mask, origin, tmin, direction, tmax);
    while (lvkRayQueryProceed(query)) {
    }
    return lvkRayQueryType(query, LVK_COMMITTED) != LVK_COMMITTED_NONE;
}

#include "large_scene/picture.glsl"

#define PIXEL_FUNCTION storePixel
#include "common/for_each_pixel.glsl"
