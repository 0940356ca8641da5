// Colours of meshlets and their light.
#include "common/tonemap.glsl"

// Colours go round once along the knot, and neighbours differ.
vec3 meshletColor(uint number, uint count) {
    vec2 chance = fract(vec2(0.75487767, 0.56984029) * float(number));
    float hue = float(number) / float(count) + 0.12 * (chance.x - 0.5);
    vec3 color = 0.5 + 0.46 * cos(6.2831853 * (hue + vec3(0.0, 0.33, 0.67)));
    return color * mix(0.45, 1.1, chance.y);
}

vec3 lit(vec3 albedo, vec3 normal, vec3 toEye) {
    vec3 toSun = normalize(vec3(0.5, 0.8, 0.6));
    vec3 ambient = mix(vec3(0.10, 0.09, 0.12), vec3(0.55, 0.65, 0.85), 0.5 + 0.5 * normal.y);
    float shine = 0.35 * pow(max(dot(normal, normalize(toSun + toEye)), 0.0), 40.0);
    return expose(albedo * (ambient + 1.9 * max(dot(normal, toSun), 0.0)) + shine);
}
