// A ray that goes on from the hit of the pixel's primary ray.
#include "bench/view.glsl"

layout(location = 0) rayPayloadEXT Hit hit;

void main() {
    uint index = gl_LaunchIDEXT.y * width + gl_LaunchIDEXT.x;
    BounceRay ray = bounceRays.at[index];
    if (ray.direction != vec3(0.0)) {
        hit = Hit(kNoHit, 0u);
        traceRayEXT(kTLAS[tlas], LVK_RAY_FLAG_OPAQUE, 0xff, 0, 0, 0, ray.origin, 0.0, ray.direction, kFar, 0);
        bounceHits.at[index] = hit;
    }
}
