// Light of lamps and sun at a point, on screen or off, with a shadow ray each: what is reflected does not depend on
// what the camera sees. Only light that arrives indirectly is approximated off screen, by ambient.glsl.
// The including file provides traceOccluded().
#ifndef REFLECTIONS_LIGHTING
#define REFLECTIONS_LIGHTING

#include "reflections/ambient.glsl"
#include "reflections/lights.glsl"

// Share of the ambient light that the reflected surroundings let through: no ray counts it there.
const float kAmbientOffScreen = 0.6;

// `lift`: how far shadow rays start above the surface.
vec3 lightDirectly(Surface surface, vec3 view, float lift, vec2 noise) {
    vec3 color = vec3(0.0);
    vec3 origin = surface.position + surface.geometricNormal * lift;
    vec2 disc = discPlace(noise);
    for (uint i = 0u; i < frame.lightCount; ++i) {
        Arriving arriving = lightAt(origin, frame.lights[i], disc);
        vec3 light = leaving(surface, view, arriving);
        if (isWorthARay(light) && !traceOccluded(origin, arriving.toLight, arriving.range)) {
            color += light;
        }
    }
    return color;
}

// Everything that leaves a surface met by a reflected ray. What it mirrors itself is taken from the sky.
vec3 shadeReflected(Surface surface, vec3 direction, float distance, vec2 noise) {
    vec3 view = -direction;
    vec3 color = surface.emission + lightDirectly(surface, view, 2e-3, noise);
    vec3 ambient = ambientIrradiance(surface.normal) * surface.albedo * (1.0 - surface.metalness);
    vec3 mirrored = reflect(direction, surface.normal);
    vec3 around = mix(skyRadiance(mirrored), ambientRadiance(mirrored), sqrt(surface.roughness));
    around *= environmentReflectance(surface, max(dot(view, surface.normal), 0.0));
    return hazed(color + kAmbientOffScreen * (ambient + around), direction, distance);
}

#endif
