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
layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    uvec2 pixel = uvec2(gl_GlobalInvocationID.x, first + gl_GlobalInvocationID.y);
    if (pixel.x < frame.camera.width && pixel.y < end) {
        renderPixel(pixel);
    }
}
#endif
