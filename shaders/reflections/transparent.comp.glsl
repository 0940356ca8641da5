// What transparent surfaces reflect, by ray queries.
#include "common/group_pixel.glsl"
#include "reflections/trace_query.glsl"
#include "reflections/reflect.glsl"

void main() {
    uvec2 first = groupPixel();
    [[dont_unroll]] for (uint i = 0u; i < kGroupPixels; ++i) {
        uvec2 pixel = first + groupStep(i);
        if (pixel.x < frame.camera.width && pixel.y < frame.camera.height) {
            transparentPixel(pixel);
        }
    }
}
