// Colours of the user interface, multiplied with their alpha. They are mixed as they are encoded, which is what its colours
// are made for.
#include "app/ui.glsl"
layout(location = 0) in vec2 uv;
layout(location = 1) in vec4 color;
layout(location = 0) out vec4 result;

vec3 linearLight(vec3 encoded) {
    return mix(encoded / 12.92, pow((encoded + 0.055) / 1.055, vec3(2.4)), greaterThan(encoded, vec3(0.04045)));
}

void main() {
    result = color * textureBindless2D(tex, smp, uv);
    if (linearTarget == 1u && result.a > 0.0) {
        result.rgb = linearLight(clamp(result.rgb / result.a, 0.0, 1.0)) * result.a;
    }
}
