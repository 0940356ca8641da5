// A shadow ray from the hit of the pixel's primary ray to the light.
#include "bench/view.glsl"

layout(location = 0) rayPayloadEXT uint reached;

void main() {
    uvec2 pixel = gl_LaunchIDEXT.xy;
    uint index = pixel.y * width + pixel.x;
    float t = hits.at[index].t;
    reached = 0u;
    if (t != kNoHit) {
        vec3 point = pixelPoint(pixel, t);
        uint flags =
            LVK_RAY_FLAG_OPAQUE | LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT | LVK_RAY_FLAG_SKIP_CLOSEST_HIT_SHADER;
        traceRayEXT(kTLAS[tlas], flags, 0xff, 0, 0, 1, point, 0.0, light - point, 1.0, 0);
    }
    lit.at[index] = reached;
}
