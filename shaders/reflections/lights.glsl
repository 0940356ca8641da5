// Lamps and sun, as a point of a surface sees them.
#ifndef REFLECTIONS_LIGHTS
#define REFLECTIONS_LIGHTS

#include "reflections/noise.glsl"
#include "reflections/ray_range.glsl"
#include "reflections/reflectance.glsl"

struct Arriving {
    vec3 toLight; // unit length
    float range; // to where the lamp begins
    vec3 color; // irradiance over pi of a surface that faces it
};

// Light from one point of a lamp's or the sun's disc: `disc` is a place in the unit circle.
Arriving lightAt(vec3 position, Light light, vec2 disc) {
    if (light.radius <= 0.0) {
        mat3 basis = basisAround(light.position);
        vec3 way = light.position + light.spread * (basis[0] * disc.x + basis[1] * disc.y);
        return Arriving(normalize(way), kFar, light.color);
    }
    vec3 way = light.position - position;
    mat3 basis = basisAround(normalize(way));
    way += 0.6 * light.radius * (basis[0] * disc.x + basis[1] * disc.y);
    float squared = dot(way, way);
    float distance = sqrt(squared);
    return Arriving(way / distance, distance - light.radius, light.color / (squared + light.radius * light.radius));
}

vec2 discPlace(vec2 noise) {
    return sqrt(noise.x) * vec2(cos(2.0 * kPi * noise.y), sin(2.0 * kPi * noise.y));
}

// Reflection of unoccluded light towards `view`.
vec3 leaving(Surface surface, vec3 view, Arriving arriving) {
    bool above = dot(arriving.toLight, surface.geometricNormal) > 0.0 && dot(arriving.toLight, surface.normal) > 0.0;
    return above ? arriving.color * scatter(surface, view, arriving.toLight) : vec3(0.0);
}

// True if light is worth a ray that asks what blocks it.
bool isWorthARay(vec3 light) {
    return max(light.r, max(light.g, light.b)) > 2e-3;
}

#endif
