// traceClosest() and traceOccluded() by the ray tracing pipeline.
#ifndef HYBRID_TRACE_PIPELINE
#define HYBRID_TRACE_PIPELINE

#include "hybrid/frame.glsl"
#include "hybrid/hit.glsl"

layout(location = 0) rayPayloadEXT Hit closestPayload;
layout(location = 1) rayPayloadEXT uint occludedPayload;

Hit traceClosest(vec3 origin, float tmin, vec3 direction, float tmax) {
    traceRayEXT(kTLAS[frame.tlas], LVK_RAY_FLAG_OPAQUE, kMaskAll, 0, 0, 0, origin, tmin, direction, tmax, 0);
    return closestPayload;
}

bool traceOccluded(vec3 origin, float tmin, vec3 direction, float tmax) {
    occludedPayload = 1u;
    const uint flags = LVK_RAY_FLAG_OPAQUE | LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT | LVK_RAY_FLAG_SKIP_CLOSEST_HIT_SHADER;
    traceRayEXT(kTLAS[frame.tlas], flags, kMaskOpaque, 0, 0, 1, origin, tmin, direction, tmax, 1);
    return occludedPayload != 0u;
}

#endif
