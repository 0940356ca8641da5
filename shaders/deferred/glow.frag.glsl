// The shine around a light, in front of all that is behind it.
#include "deferred/light_output.glsl"
layout(location = 0) in vec2 place;
layout(location = 1) flat in vec3 color;

void main() {
    float from = dot(place, place);
    if (from > 1.0) {
        discard;
    }
    float shine = exp(-9.0 * from) * (1.0 - from);
    lit = vec4(0.2 * shine * color, 0.0);
}
