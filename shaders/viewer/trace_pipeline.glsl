// traceWithin() and transmittanceTo() by the ray tracing pipeline.
#ifndef VIEWER_TRACE_PIPELINE
#define VIEWER_TRACE_PIPELINE

#include "viewer/hit.glsl"

layout(location = 0) rayPayloadEXT Payload payload;

// The nearest surface up to `range` away, at the distance `range` where there is none. `flags`: of the ray.
Hit traceWithin(vec3 origin, vec3 direction, float range, uint seed, uint flags) {
    payload.seed = seed;
    payload.hit.distance = range;
    traceRayEXT(kTLAS[frame.tlas], flags, 0xffu, 0, 0, 0, origin, 0.0, direction, range, 0);
    return payload.hit;
}

// The share of light that comes from `range` away: 0 where something opaque is between.
vec3 transmittanceTo(vec3 origin, vec3 direction, float range) {
    payload.seed = kShadow;
    payload.transmittance = vec3(1.0);
    payload.hit.instance = 0u;
    const uint flags = LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT | LVK_RAY_FLAG_SKIP_CLOSEST_HIT_SHADER;
    traceRayEXT(kTLAS[frame.tlas], flags, 0xffu, 0, 0, 0, origin, 0.0, direction, range, 0);
    return payload.hit.instance == kNothing ? payload.transmittance : vec3(0.0);
}

#endif
