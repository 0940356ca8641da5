// The probe of the surfaces around the eye, by ray queries.
#include "viewer/trace_query.glsl"
#include "viewer/ambient_probe.glsl"
#include "common/group_pixel.glsl"

void main() {
    uvec2 first = groupPixel();
    [[dont_unroll]] for (uint i = 0u; i < kGroupPixels; ++i) {
        probe(first + groupStep(i));
    }
}
