// What opaque surfaces reflect, by ray queries.
#include "reflections/trace_query.glsl"
#include "reflections/reflect.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (pixel.x < frame.camera.width && pixel.y < frame.camera.height) {
        opaquePixel(pixel);
    }
}
