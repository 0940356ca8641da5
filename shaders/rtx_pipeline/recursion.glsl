// Hit shaders trace on: shadow rays, and the ray that goes on. Each is one level deeper.
#ifndef RTX_PIPELINE_RECURSION
#define RTX_PIPELINE_RECURSION

#include "rtx_pipeline/frame.glsl"
#include "rtx_pipeline/radiance.glsl"

layout(location = 0) rayPayloadInEXT Radiance payload;
layout(location = 1) rayPayloadEXT Radiance beyond;
layout(location = 2) rayPayloadEXT uint occluded;
hitAttributeEXT vec2 barycentrics;

// The miss shader kLight says that nothing was in the way.
bool traceOccluded(vec3 origin, float tmin, vec3 direction, float tmax) {
    occluded = 1u;
    const uint flags = LVK_RAY_FLAG_OPAQUE | LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT | LVK_RAY_FLAG_SKIP_CLOSEST_HIT_SHADER;
    traceRayEXT(kTLAS[frame.tlas], flags, kMaskSolid, 0, 0, kLight, origin, tmin, direction, tmax, 2);
    return occluded != 0u;
}

#include "rtx_pipeline/shade.glsl"

SurfacePoint hitPoint() {
    uint triangle = uint(gl_InstanceCustomIndexEXT) + uint(lvkPrimitiveIndex(frame.tlas));
    return pointOf(triangle, barycentrics, gl_WorldRayOriginEXT, gl_WorldRayDirectionEXT, payload.cone);
}

void answer(Shaded shaded) {
    vec3 light = shaded.light;
    if (isFollowed(shaded.onward, payload.depth)) {
        beyond = Radiance(vec3(0.0), shaded.onward.cone, payload.depth + 1u);
        traceRayEXT(kTLAS[frame.tlas], LVK_RAY_FLAG_OPAQUE, kMaskAll, 0, 0, kSky, shaded.onward.origin, 0.0,
                    shaded.onward.direction, kFar, 1);
        light += shaded.onward.weight * beyond.light;
    }
    payload.light = light;
}

#endif
