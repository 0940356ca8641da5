// One pixel by the ray tracing pipeline.
#include "hybrid/trace_pipeline.glsl"
#include "hybrid/pixel.glsl"

void main() {
#if defined(HYBRID_ORDERED)
    renderPixel(pixelInOrder(first + gl_LaunchIDEXT.x));
#else
    renderPixel(uvec2(gl_LaunchIDEXT.x, first + gl_LaunchIDEXT.y));
#endif
}
