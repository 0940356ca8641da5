// Light of lamps and sun at a point, on screen or off, with a shadow ray each: what is reflected does not depend on
// what the camera sees. Only light that arrives indirectly is approximated off screen, by ambient.glsl.
// The including file provides traceOccluded().
#ifndef REFLECTIONS_LIGHTING
#define REFLECTIONS_LIGHTING

#include "reflections/ambient.glsl"
#include "reflections/noise.glsl"
#include "reflections/reflectance.glsl"
#include "reflections/range.glsl"

// Share of the ambient light that the reflected surroundings let through: no ray counts it there.
const float kAmbientOffScreen = 0.6;

// `lift`: how far shadow rays start above the surface.
vec3 lightDirectly(Surface surface, vec3 view, float lift, vec2 noise) {
    vec3 color = vec3(0.0);
    vec3 origin = surface.position + surface.geometricNormal * lift;
    vec2 disc = sqrt(noise.x) * vec2(cos(2.0 * kPi * noise.y), sin(2.0 * kPi * noise.y));
    for (uint i = 0u; i < frame.lightCount; ++i) {
        Light light = frame.lights[i];
        vec3 way = light.position;
        float range = kFar;
        vec3 arriving = light.color;
        if (light.radius > 0.0) {
            way = light.position - origin;
            mat3 basis = basisAround(normalize(way));
            way += 0.6 * light.radius * (basis[0] * disc.x + basis[1] * disc.y);
            arriving /= dot(way, way) + light.radius * light.radius;
            range = length(way) - light.radius;
        } else {
            mat3 basis = basisAround(way);
            way += light.spread * (basis[0] * disc.x + basis[1] * disc.y);
        }
        vec3 toLight = normalize(way);
        bool above = dot(toLight, surface.geometricNormal) > 0.0 && dot(toLight, surface.normal) > 0.0;
        vec3 leaving = above ? arriving * scatter(surface, view, toLight) : vec3(0.0);
        // What adds less than this is not worth a ray.
        if (max(leaving.x, max(leaving.y, leaving.z)) > 2e-3 && !traceOccluded(origin, toLight, range)) {
            color += leaving;
        }
    }
    return color;
}

// Everything that leaves a surface met by a reflected ray. What it mirrors itself is taken from the sky.
vec3 shadeReflected(Surface surface, vec3 direction, vec2 noise) {
    vec3 view = -direction;
    vec3 color = surface.emission + lightDirectly(surface, view, 2e-3, noise);
    vec3 ambient = ambientIrradiance(surface.normal) * surface.albedo * (1.0 - surface.metalness);
    vec3 mirrored = reflect(direction, surface.normal);
    vec3 around = mix(skyRadiance(mirrored), ambientRadiance(mirrored), sqrt(surface.roughness));
    around *= environmentReflectance(surface, max(dot(view, surface.normal), 0.0));
    return color + kAmbientOffScreen * (ambient + around);
}

#endif
