// traceClosest() and traceBlocker() by the ray tracing pipeline.
#ifndef REFLECTIONS_TRACE_PIPELINE
#define REFLECTIONS_TRACE_PIPELINE

#include "reflections/masks.glsl"
#include "reflections/surface.glsl"

layout(location = 0) rayPayloadEXT Hit payload;

Hit traceClosest(vec3 origin, vec3 direction, float range) {
    traceRayEXT(kTLAS[frame.tlas], LVK_RAY_FLAG_NONE, kMaskAll, 0, 0, 0, origin, 0.0, direction, range, 0);
    return payload;
}

// Distance of what blocks the way, the nearest unless `flags` end the ray before; below 0 where nothing does.
float traceBlocker(vec3 origin, vec3 direction, float range, uint flags) {
    traceRayEXT(kTLAS[frame.tlas], flags, kMaskOpaque, 0, 0, 0, origin, 0.0, direction, range, 0);
    return payload.instance == kNothing ? -1.0 : payload.distance;
}

#endif
