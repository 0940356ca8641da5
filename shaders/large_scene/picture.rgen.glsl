// A pixel by the ray tracing pipeline.
#include "large_scene/frame.glsl"
#include "large_scene/hit.glsl"

// Places of miss shaders in the pipeline.
const uint kNearest = 0u;
const uint kOpen = 1u;

layout(location = 0) rayPayloadEXT Hit nearest;
layout(location = 1) rayPayloadEXT uint occluded;

Hit traceNearest(uint mask, vec3 origin, vec3 direction, float tmax) {
    traceRayEXT(kTLAS[frame.tlas], LVK_RAY_FLAG_OPAQUE, mask, 0, 0, kNearest, origin, 0.0, direction, tmax, 0);
    return nearest;
}

bool occludedBy(uint mask, vec3 origin, float tmin, vec3 direction, float tmax) {
    occluded = 1u;
    const uint flags = LVK_RAY_FLAG_OPAQUE | LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT | LVK_RAY_FLAG_SKIP_CLOSEST_HIT_SHADER;
    traceRayEXT(kTLAS[frame.tlas], flags, mask, 0, 0, kOpen, origin, tmin, direction, tmax, 1);
    return occluded != 0u;
}

#include "large_scene/picture.glsl"

void main() {
    storePixel(gl_LaunchIDEXT.xy);
}
