// Sunlight by the ray tracing pipeline.
#include "hybrid_oit/payload.glsl"
#include "hybrid_oit/sphere.glsl"

layout(location = 0) rayPayloadEXT Sunlight payload;

vec3 traceSunlight(vec3 origin, vec3 direction) {
    payload = Sunlight(uvec3(0u), 1u);
    const uint flags = LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT | LVK_RAY_FLAG_SKIP_CLOSEST_HIT_SHADER;
    traceRayEXT(kTLAS[frame.tlas], flags, 0xffu, 0, 0, 0, origin, 0.0, direction, 1e4, 0);
    return payload.isBlocked != 0u ? vec3(0.0) : transmittanceOf(payload.opticalDepth);
}

#include "hybrid_oit/shadow.glsl"

void main() {
    shadowAt(gl_LaunchIDEXT.xy);
}
