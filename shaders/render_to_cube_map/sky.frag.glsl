// The sky behind everything.
#include "render_to_cube_map/light.glsl"
layout(location = 0) in vec3 direction;
layout(location = 0) out vec4 result;

void main() {
    result = targetColor(skyColor(normalize(direction)));
}
