// The ray passes: what the opaque and the transparent surfaces of a pixel reflect, from depth and normals.
// The including file provides traceClosest() and traceOccluded().
#ifndef REFLECTIONS_REFLECT
#define REFLECTIONS_REFLECT

#include "reflections/gbuffer.glsl"
#include "reflections/lighting.glsl"
#include "reflections/ray_range.glsl"
#include "reflections/visibility.glsl"

// Panes and leaves of water that a reflected ray may pass.
const int kMostPanes = 2;

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
            color += weight * mix(shadeReflected(surface, direction, travelled, noise), ambientRadiance(direction), faded);
            break;
        }
        float fresnel = fresnelSchlick(vec3(0.04), -dot(surface.geometricNormal, direction)).x;
        vec3 mirrored = ambientRadiance(reflect(direction, surface.geometricNormal));
        color += weight * (fresnel * mirrored + surface.opacity * surface.albedo * ambientIrradiance(vec3(0.0, 1.0, 0.0)));
        weight *= (1.0 - fresnel) * (1.0 - surface.opacity);
        origin = surface.position - surface.geometricNormal * 2e-3;
    }
    return vec4(color, met);
}

// The brightest that a ray may report. Few rays of a wide lobe meet flames and lanterns; what they would say at full
// strength is specks.
float brightestReflected(float roughness) {
    return mix(30.0, 4.0, smoothstep(0.04, 0.25, roughness));
}

vec4 reflectionOf(Surface surface, vec3 direction, float distance, vec2 noise, vec2 shadowNoise) {
    float range = reflectionRange(surface.roughness);
    if (range <= 0.0) {
        return vec4(ambientRadiance(reflect(direction, surface.normal)), 0.0);
    }
    mat3 basis = basisAround(surface.normal);
    float alpha = lobeTangent(surface.roughness);
    vec3 normal = basis * visibleNormal(-direction * basis, alpha, vec2(0.75 * noise.x, noise.y));
    vec3 mirrored = keptAbove(reflect(direction, normal), surface.geometricNormal);
    vec3 origin = surface.position + surface.geometricNormal * liftAt(distance);
    float cone = distance * frame.camera.pixelSpread;
    vec4 reflection = radianceAlong(origin, mirrored, range, cone, shadowNoise);
    return vec4(min(reflection.rgb, vec3(brightestReflected(surface.roughness))), reflection.a);
}

void opaquePixel(uvec2 pixel) {
    vec3 direction = cameraDirection(frame.camera, pixel);
    Surface surface;
    float distance;
    vec4 visibility = vec4(1.0);
    vec4 penumbra = vec4(0.0);
    vec4 reflection = vec4(0.0);
    if (readSurface(frame.opaqueDepth, frame.opaqueSurface, pixel, direction, surface, distance)) {
        visibility = visibilityOf(surface, -direction, distance, spreadNoise(pixel, 0u), spreadNoise(pixel, 1u), penumbra);
        reflection = reflectionOf(surface, direction, distance, spreadNoise(pixel, 2u), pixelNoise(pixel, 3u));
    }
    imageStore(kImages2D[frame.visibility], ivec2(pixel), visibility);
    imageStore(kImages2D[frame.penumbra], ivec2(pixel), penumbra);
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
