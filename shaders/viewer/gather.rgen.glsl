// Light of a pixel, by the ray tracing pipeline.
#include "viewer/trace_pipeline.glsl"
#include "viewer/gather.glsl"

void main() {
    gatherPixel(gl_LaunchIDEXT.xy);
}
