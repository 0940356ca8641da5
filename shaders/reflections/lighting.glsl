// Light of lamps and sun at a point that a reflected ray met, on screen or off, with shadow rays of its own: what is reflected does
// not depend on what the camera sees. Only light that arrives indirectly is approximated off screen, by ambient.glsl.
#ifndef REFLECTIONS_LIGHTING
#define REFLECTIONS_LIGHTING

#include "reflections/ambient.glsl"
#include "reflections/visibility.glsl"

// Share of the ambient light that the reflected surroundings let through: no ray counts it there.
const float kAmbientOffScreen = 0.6;

// `visibility`: a channel for each light, 1 where nothing blocks it, or where the light is too dim for a ray.
vec3 lightDirectly(LitPoint point, vec4 visibility) {
    vec3 color = vec3(0.0);
    for (uint i = 0u; i < frame.lightCount; ++i) {
        color += visibility[i] * leaving(point.surface, point.view, lightAt(point.origin, frame.lights[i], point.disc));
    }
    return color;
}

// Everything that leaves a surface met by a reflected ray. What it mirrors itself is taken from the sky.
vec3 shadeReflected(LitPoint point, vec4 visibility, float distance) {
    Surface surface = point.surface;
    vec3 color = surface.emission + lightDirectly(point, visibility);
    vec3 ambient = ambientIrradiance(surface.normal) * surface.albedo * (1.0 - surface.metalness);
    vec3 mirrored = reflect(-point.view, surface.normal);
    vec3 around = mix(skyRadiance(mirrored), ambientRadiance(mirrored), sqrt(surface.roughness));
    around *= environmentReflectance(surface, max(dot(point.view, surface.normal), 0.0));
    return hazed(color + kAmbientOffScreen * (ambient + around), -point.view, distance);
}

#endif
