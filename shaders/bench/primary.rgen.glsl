#include "bench/view.glsl"

layout(location = 0) rayPayloadEXT Hit hit;

void main() {
    uvec2 pixel = gl_LaunchIDEXT.xy;
    hit = Hit(kNoHit, 0u);
    traceRayEXT(kTLAS[tlas], LVK_RAY_FLAG_OPAQUE, 0xff, 0, 0, 0, eye, 0.0, pixelDirection(pixel), kFar, 0);
    hits.at[pixel.y * width + pixel.x] = hit;
}
