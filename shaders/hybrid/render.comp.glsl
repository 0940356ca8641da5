// One pixel by ray queries.
#include "hybrid/trace_query.glsl"
#include "hybrid/pixel.glsl"

#if defined(HYBRID_ORDERED)
layout(local_size_x = 64) in;

void main() {
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint index = first + group * gl_WorkGroupSize.x + gl_LocalInvocationIndex;
    if (index < end) {
        renderPixel(pixelInOrder(index));
    }
}
#else
#include "common/group_pixel.glsl"

void main() {
    uvec2 start = groupPixel() + uvec2(0u, first);
    [[dont_unroll]] for (uint i = 0u; i < kGroupPixels; ++i) {
        uvec2 pixel = start + groupStep(i);
        if (pixel.x < frame.camera.width && pixel.y < end) {
            renderPixel(pixel);
        }
    }
}
#endif
