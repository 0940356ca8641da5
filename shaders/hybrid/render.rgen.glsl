// One pixel by the ray tracing pipeline.
#include "hybrid/trace_pipeline.glsl"
#include "hybrid/pixel.glsl"

void main() {
    renderPixel(uvec2(gl_LaunchIDEXT.x, firstRow + gl_LaunchIDEXT.y));
}
