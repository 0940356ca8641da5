// Colour of the blocks around, and of the floor.
#include "render_to_cube_map/light.glsl"
layout(location = 0) in vec3 position;
layout(location = 1) flat in vec3 normal;
layout(location = 2) flat in uint number;
layout(location = 0) out vec4 result;

// Light and dark squares of length 1, as much of each as lies in the pixel.
float squares(vec2 at) {
    vec2 width = max(fwidth(at), 1e-4);
    vec2 low = at - 0.5 * width;
    vec2 high = at + 0.5 * width;
    // The integral of a wave that is 1 and -1 in turns.
    vec2 wave = (abs(fract(0.5 * high) - 0.5) - abs(fract(0.5 * low) - 0.5)) * 2.0 / width;
    float fade = clamp(2.0 - max(width.x, width.y), 0.0, 1.0); // where a pixel holds several
    return 0.5 - 0.5 * fade * wave.x * wave.y;
}

void main() {
    Block block = frame.blocks.at[number];
    vec3 albedo = block.isFloor == 1u ? mix(vec3(0.09, 0.10, 0.12), vec3(0.62, 0.58, 0.53), squares(position.xz)) : block.color;
    result = targetColor(lit(albedo, position, normal));
}
