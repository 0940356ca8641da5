// Surface data for the lighting shaders.
#include "deferred/frame.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) flat in uint material;
layout(location = 0) out vec4 albedoAndRoughness;
layout(location = 1) out vec4 normalAndMetalness;

// Slabs of two kinds with joints between them.
void paveWith(float side, inout vec3 albedo, inout float roughness) {
    vec2 place = position.xz / side;
    vec2 within = abs(fract(place) - 0.5);
    float other = mod(floor(place.x) + floor(place.y), 2.0);
    albedo *= mix(1.0, 0.22, other);
    roughness *= mix(1.0, 0.62, other);
    float joint = max(within.x, within.y);
    if (joint > 0.5 - 0.012 / side) {
        albedo *= 0.3;
        roughness = 0.8;
    }
}

void main() {
    Material m = frame.materials.at[material];
    vec3 albedo = m.albedo;
    float roughness = m.roughness;
    if (m.tiles > 0.0) {
        paveWith(m.tiles, albedo, roughness);
    }
    albedoAndRoughness = vec4(sqrt(albedo), roughness);
    normalAndMetalness = vec4(normalize(normal), m.metalness);
}
