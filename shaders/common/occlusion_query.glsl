// Whether anything opaque is in the way of a ray, by a ray query. The including file includes <lvk/ray_query.glsl> before.
#ifndef COMMON_OCCLUSION_QUERY
#define COMMON_OCCLUSION_QUERY

bool occludedByQuery(uint tlas, uint mask, vec3 origin, float tmin, vec3 direction, float tmax) {
    LvkRayQuery query;
    const uint flags = LVK_RAY_FLAG_OPAQUE | LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT;
    lvkRayQueryInitialize(query, tlas, flags, mask, origin, tmin, direction, tmax);
    while (lvkRayQueryProceed(query)) {
    }
    return lvkRayQueryType(query, LVK_COMMITTED) != LVK_COMMITTED_NONE;
}

#endif
