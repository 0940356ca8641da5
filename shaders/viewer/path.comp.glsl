// Paths of a pixel, by ray queries.
#include "common/group_pixel.glsl"
#include "viewer/trace_query.glsl"
#include "viewer/sample_paths.glsl"

void main() {
    samplePaths();
}
