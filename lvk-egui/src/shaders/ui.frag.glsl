// Colours of an interface, multiplied with their alpha. Egui multiplies them as they are encoded.
#include "push.glsl"
layout(location = 0) in vec2 uv;
layout(location = 1) in vec4 color;
layout(location = 0) out vec4 result;

vec3 decode(vec3 encoded) {
    return mix(encoded / 12.92, pow((encoded + 0.055) / 1.055, vec3(2.4)), greaterThan(encoded, vec3(0.04045)));
}

vec3 encode(vec3 linear) {
    return mix(linear * 12.92, 1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055, greaterThan(linear, vec3(0.0031308)));
}

void main() {
    vec4 texel = textureBindless2D(tex, smp, uv);
    if ((flags & 2u) != 0u && texel.a > 0.0) {
        texel.rgb = encode(clamp(texel.rgb / texel.a, 0.0, 1.0)) * texel.a;
    }
    result = color * texel;
    if ((flags & 1u) != 0u && result.a > 0.0) {
        result.rgb = decode(clamp(result.rgb / result.a, 0.0, 1.0)) * result.a;
    }
}
