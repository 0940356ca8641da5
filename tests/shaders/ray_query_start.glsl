// The start of a compute shader that traces one ray for each invocation: START_RAY_QUERY declares the invocation's index, its
// ray and a ray query along it, and returns beyond the last ray.
#ifndef RAY_QUERY_START
#define RAY_QUERY_START
#include <lvk/ray_query.glsl>
#include "ray_records.glsl"

layout(local_size_x = 64) in;

#define START_RAY_QUERY                       \
    uint index = gl_GlobalInvocationID.x;     \
    if (index >= count) {                     \
        return;                               \
    }                                         \
    Ray ray = rays.at[index];                 \
    LvkRayQuery rq;                           \
    lvkRayQueryInitialize(rq, tlas, flags, mask, ray.origin, ray.tMin, ray.direction, ray.tMax)

#endif
