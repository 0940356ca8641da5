// The ray passes: what the opaque and the transparent surfaces of a pixel reflect, from depth and normals.
// The including file provides traceClosest() and traceOccluded().
#ifndef REFLECTIONS_REFLECT
#define REFLECTIONS_REFLECT

#include "reflections/gbuffer.glsl"
#include "reflections/lighting.glsl"
#include "reflections/range.glsl"

// Panes and leaves of water that a reflected ray may pass.
const int kMostPanes = 2;
const float kOpenness = 2.2; // scene units; as far as surroundings darken a surface

// Radiance along a ray, and how far away what it met is. A ray that ends before it met anything sees the ambient
// light in place of what is there; that the end does not show as an edge, it fades into it.
vec4 radianceAlong(vec3 origin, vec3 direction, float range, float coneStart, vec2 noise) {
    vec3 color = vec3(0.0);
    float weight = 1.0;
    float met = range;
    float travelled = 0.0;
    for (int panes = 0;; ++panes) {
        Hit hit = traceClosest(origin, direction, range - travelled);
        if (hit.instance == kNothing) {
            color += weight * (range < kFar ? ambientRadiance(direction) : skyRadiance(direction));
            break;
        }
        travelled += hit.distance;
        Surface surface = surfaceOf(hit, direction, coneStart + travelled * frame.camera.pixelSpread);
        met = panes == 0 ? travelled : met;
        float faded = range < kFar ? smoothstep(0.6, 1.0, travelled / range) : 0.0;
        if (surface.opacity >= 1.0 || panes == kMostPanes) {
            color += weight * mix(shadeReflected(surface, direction, noise), ambientRadiance(direction), faded);
            break;
        }
        float fresnel = fresnelSchlick(vec3(0.04), -dot(surface.geometricNormal, direction)).x;
        vec3 mirrored = ambientRadiance(reflect(direction, surface.geometricNormal));
        color += weight * (fresnel * mirrored + surface.opacity * surface.albedo * ambientIrradiance(vec3(0.0, 1.0, 0.0)));
        weight *= (1.0 - fresnel) * (1.0 - surface.opacity);
        origin = surface.position - surface.geometricNormal * 2e-3;
    }
    return vec4(min(color, vec3(30.0)), met);
}

// How far from the surface rays start: beyond what depth and normals are rounded by.
float liftAt(float distance) {
    return 1.5e-3 + 2.5e-4 * distance;
}

vec3 keptAbove(vec3 direction, vec3 geometricNormal) {
    float below = dot(direction, geometricNormal);
    return below < 5e-3 ? normalize(direction + geometricNormal * (5e-3 - below)) : direction;
}

float openness(Surface surface, float lift, vec2 noise) {
    float angle = 2.0 * kPi * noise.y;
    vec3 local = vec3(sqrt(noise.x) * vec2(cos(angle), sin(angle)), sqrt(1.0 - noise.x));
    vec3 direction = keptAbove(basisAround(surface.normal) * local, surface.geometricNormal);
    return traceOccluded(surface.position + surface.geometricNormal * lift, direction, kOpenness) ? 0.0 : 1.0;
}

vec4 reflectionOf(Surface surface, vec3 direction, float distance, vec2 noise, vec2 shadowNoise) {
    float range = reflectionRange(surface.roughness);
    if (range <= 0.0) {
        return vec4(ambientRadiance(reflect(direction, surface.normal)), 0.0);
    }
    mat3 basis = basisAround(surface.normal);
    float alpha = lobeTangent(surface.roughness);
    vec3 normal = basis * visibleNormal(-direction * basis, alpha, vec2(0.9 * noise.x, noise.y));
    vec3 mirrored = keptAbove(reflect(direction, normal), surface.geometricNormal);
    vec3 origin = surface.position + surface.geometricNormal * liftAt(distance);
    float cone = distance * frame.camera.pixelSpread;
    return radianceAlong(origin, mirrored, range, cone, shadowNoise);
}

void opaquePixel(uvec2 pixel) {
    vec3 direction = cameraDirection(frame.camera, pixel);
    Surface surface;
    float distance;
    vec4 direct = vec4(0.0);
    vec4 reflection = vec4(0.0);
    if (readSurface(frame.opaqueDepth, frame.opaqueSurface, pixel, direction, surface, distance)) {
        float lift = liftAt(distance);
        direct.rgb = lightDirectly(surface, -direction, lift, pixelNoise(pixel, 0u));
        direct.a = openness(surface, lift, pixelNoise(pixel, 1u));
        reflection = reflectionOf(surface, direction, distance, pixelNoise(pixel, 2u), pixelNoise(pixel, 3u));
    }
    imageStore(kImages2D[frame.direct], ivec2(pixel), direct);
    imageStore(kImages2D[frame.reflection], ivec2(pixel), reflection);
}

// Only where the transparent g-buffer has something that the opaque one does not hide: its depth is the mask.
void transparentPixel(uvec2 pixel) {
    vec3 direction = cameraDirection(frame.camera, pixel);
    Surface surface;
    float distance;
    vec4 reflection = vec4(0.0);
    if (readSurface(frame.glassDepth, frame.glassSurface, pixel, direction, surface, distance)) {
        reflection = reflectionOf(surface, direction, distance, vec2(0.0), pixelNoise(pixel, 4u));
    }
    imageStore(kImages2D[frame.glassReflection], ivec2(pixel), reflection);
}

#endif
