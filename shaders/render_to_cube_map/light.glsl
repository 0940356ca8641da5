// Sun and sky of the surroundings, in linear light.
#ifndef RENDER_TO_CUBE_MAP_LIGHT
#define RENDER_TO_CUBE_MAP_LIGHT

#include "common/tonemap.glsl"
#include "render_to_cube_map/frame.glsl"

const vec3 kToSun = vec3(0.5121, 0.6401, 0.5729);
const vec3 kSun = vec3(2.9, 2.5, 2.0);
const vec3 kHorizon = vec3(1.75, 1.42, 1.2);

vec3 skyColor(vec3 direction) {
    float up = max(direction.y, 0.0);
    vec3 color = mix(kHorizon, vec3(0.12, 0.42, 1.25), 1.0 - exp(-3.0 * up));
    float towardsSun = max(dot(direction, kToSun), 0.0);
    return color + kSun * (0.25 * pow(towardsSun, 24.0) + 9.0 * smoothstep(0.9990, 0.9995, towardsSun));
}

// The share of the sun that the drop lets pass, and of the sky.
vec2 besideDrop(vec3 position, vec3 normal) {
    vec3 offset = kDrop - position;
    float along = dot(offset, kToSun);
    float beside = length(offset - along * kToSun);
    float sun = along > 0.0 ? smoothstep(0.85 * kRadius, 1.1 * kRadius, beside) : 1.0;
    float sky = 1.0 - max(dot(normal, normalize(offset)), 0.0) * kRadius * kRadius / max(dot(offset, offset), 1.0);
    return vec2(sun, sky);
}

vec3 lit(vec3 albedo, vec3 position, vec3 normal) {
    vec2 beside = besideDrop(position, normal);
    vec3 ambient = mix(vec3(0.22, 0.17, 0.15), vec3(0.45, 0.50, 0.62), 0.5 + 0.5 * normal.y);
    vec3 light = ambient * beside.y + kSun * beside.x * max(dot(normal, kToSun), 0.0);
    float haze = 1.0 - exp(-0.0003 * dot(position, position));
    return mix(albedo * light, kHorizon, haze);
}

// Radiance as the target takes it: faces hold it as it is, the picture what a film makes of it.
vec4 targetColor(vec3 radiance) {
#ifdef PICTURE
    return vec4(expose(radiance), 1.0);
#else
    return vec4(radiance, 1.0);
#endif
}

#endif
