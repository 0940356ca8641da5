// Paths of a pixel, by the ray tracing pipeline.
#define VIEWER_RAYGEN
#include "viewer/trace_pipeline.glsl"
#include "viewer/sample_paths.glsl"

void main() {
    samplePaths();
}
