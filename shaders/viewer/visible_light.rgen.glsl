// Light of a pixel, by the ray tracing pipeline.
#define VIEWER_RAYGEN
#include "viewer/trace_pipeline.glsl"
#include "viewer/visible_light.glsl"

void main() {
    visibleLight();
}
