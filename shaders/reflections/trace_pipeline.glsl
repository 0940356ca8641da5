// traceClosest(), traceOccluder() and traceOccluded() by the ray tracing pipeline.
#ifndef REFLECTIONS_TRACE_PIPELINE
#define REFLECTIONS_TRACE_PIPELINE

#include "reflections/masks.glsl"
#include "reflections/surface.glsl"

layout(location = 0) rayPayloadEXT Hit closestPayload;
layout(location = 1) rayPayloadEXT uint occludedPayload;

Hit traceClosest(vec3 origin, vec3 direction, float range) {
    traceRayEXT(kTLAS[frame.tlas], LVK_RAY_FLAG_NONE, kMaskAll, 0, 0, 0, origin, 0.0, direction, range, 0);
    return closestPayload;
}

// Distance of something that blocks the way, not the nearest; below 0 where nothing does.
float traceOccluder(vec3 origin, vec3 direction, float range) {
    const uint flags = LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT;
    traceRayEXT(kTLAS[frame.tlas], flags, kMaskOpaque, 0, 0, 0, origin, 0.0, direction, range, 0);
    return closestPayload.instance == kNothing ? -1.0 : closestPayload.distance;
}

bool traceOccluded(vec3 origin, vec3 direction, float range) {
    occludedPayload = 1u;
    const uint flags = LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT | LVK_RAY_FLAG_SKIP_CLOSEST_HIT_SHADER;
    traceRayEXT(kTLAS[frame.tlas], flags, kMaskOpaque, 0, 0, 1, origin, 0.0, direction, range, 1);
    return occludedPayload != 0u;
}

#endif
