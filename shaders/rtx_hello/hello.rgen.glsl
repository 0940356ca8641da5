// Rays of a pixel, by the ray tracing pipeline.
#include "rtx_hello/view.glsl"
layout(location = 0) rayPayloadEXT vec3 color;

void main() {
    uvec2 pixel = gl_LaunchIDEXT.xy;
    vec3 sum = vec3(0.0);
    for (uint place = 0u; place < 4u; ++place) {
        traceRayEXT(kTLAS[tlas], LVK_RAY_FLAG_OPAQUE, 0xffu, 0, 0, 0, camera.eye, 0.0, rayDirection(pixel, place), 99.0, 0);
        sum += color;
    }
    imageStore(kImages2D[image], ivec2(pixel), vec4(sum / 4.0, 1.0));
}
