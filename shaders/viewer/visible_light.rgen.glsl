// Light of a pixel, by the ray tracing pipeline.
#include "viewer/trace_pipeline.glsl"
#include "viewer/visible_light.glsl"

void main() {
    visibleLightPixel(gl_LaunchIDEXT.xy);
}
