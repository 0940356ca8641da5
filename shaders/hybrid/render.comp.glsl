// One pixel by ray queries.
#include "hybrid/trace_query.glsl"
#include "hybrid/pixel.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    uvec2 pixel = uvec2(gl_GlobalInvocationID.x, firstRow + gl_GlobalInvocationID.y);
    if (pixel.x < frame.camera.width && pixel.y < endRow) {
        renderPixel(pixel);
    }
}
