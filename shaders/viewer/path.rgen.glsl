// Paths of a pixel, by the ray tracing pipeline.
#include "viewer/trace_pipeline.glsl"
#include "viewer/path.glsl"

void main() {
    pathPixel(gl_LaunchIDEXT.xy);
}
