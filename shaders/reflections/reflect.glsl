// The ray passes: what the opaque and the transparent surfaces of a pixel reflect, from depth and normals.
// The including file provides traceClosest() and traceBlocker().
#ifndef REFLECTIONS_REFLECT
#define REFLECTIONS_REFLECT

#include "reflections/gbuffer.glsl"
#include "reflections/lighting.glsl"
#include "reflections/ray_range.glsl"

// Panes and leaves of water that a reflected ray may pass.
const int kMostPanes = 2;
const float kUnbounded = 1e30;

// What a surface reflects: radiance so far, and a point whose light is to be added.
struct Reflection {
    vec3 color;
    float met; // distance of what the ray met first, or where it ended
    float weight; // of the point's light
    float faded; // share of ambient light in its place
    float distance; // of the point along the ray
    LitPoint point;
    float brightest; // the brightest that the ray may report
};

// Follows a ray through panes to the surface that it shows. A ray that ends before it met anything sees the ambient light in place of
// what is there; that the end does not show as an edge, it fades into it.
void follow(inout Reflection reflection, vec3 origin, vec3 direction, float range, float coneStart) {
    float travelled = 0.0;
    float weight = 1.0;
    for (int panes = 0;; ++panes) {
        Hit hit = traceClosest(origin, direction, range - travelled);
        if (hit.instance == kNothing) {
            reflection.color += weight * (range < kFar ? ambientRadiance(direction) : skyRadiance(direction));
            return;
        }
        travelled += hit.distance;
        Surface surface = surfaceOf(hit, direction, coneStart + travelled * frame.camera.pixelSpread);
        reflection.met = panes == 0 ? travelled : reflection.met;
        if (surface.opacity >= 1.0 || panes == kMostPanes) {
            reflection.faded = range < kFar ? smoothstep(0.6, 1.0, travelled / range) : 0.0;
            reflection.weight = weight;
            reflection.distance = travelled;
            reflection.point.surface = surface;
            reflection.point.view = -direction;
            reflection.point.origin = surface.position + surface.geometricNormal * 2e-3;
            return;
        }
        float fresnel = fresnelSchlick(vec3(0.04), -dot(surface.geometricNormal, direction)).x;
        vec3 mirrored = ambientRadiance(reflect(direction, surface.geometricNormal));
        reflection.color += weight * (fresnel * mirrored
            + surface.opacity * surface.albedo * ambientIrradiance(vec3(0.0, 1.0, 0.0)));
        weight *= (1.0 - fresnel) * (1.0 - surface.opacity);
        origin = surface.position - surface.geometricNormal * 2e-3;
    }
}

// The brightest that a ray may report. Few rays of a wide lobe meet flames and lanterns; what they would say at full
// strength is specks.
float brightestReflected(float roughness) {
    return mix(30.0, 4.0, smoothstep(0.04, 0.25, roughness));
}

Reflection reflectionOf(Surface surface, vec3 direction, float distance, vec2 noise, vec2 shadowNoise) {
    float range = reflectionRange(surface.roughness);
    LitPoint none = LitPoint(surface, -direction, surface.position, discPlace(shadowNoise));
    Reflection reflection = Reflection(vec3(0.0), range, 0.0, 0.0, 0.0, none, brightestReflected(surface.roughness));
    if (range <= 0.0) {
        reflection.color = ambientRadiance(reflect(direction, surface.normal));
        reflection.brightest = kUnbounded;
        return reflection;
    }
    mat3 basis = basisAround(surface.normal);
    float alpha = lobeTangent(surface.roughness);
    vec3 normal = basis * visibleNormal(-direction * basis, alpha, vec2(0.75 * noise.x, noise.y));
    vec3 mirrored = keptAbove(reflect(direction, normal), surface.geometricNormal);
    vec3 origin = surface.position + surface.geometricNormal * liftAt(distance);
    follow(reflection, origin, mirrored, range, distance * frame.camera.pixelSpread);
    return reflection;
}

// Adds the light of the point that the reflection shows. The last channel is the distance of what the ray met.
vec4 litReflection(Reflection reflection, vec4 blockers) {
    vec3 color = reflection.color;
    if (reflection.weight > 0.0) {
        vec3 shaded = shadeReflected(reflection.point, visibilityOf(blockers), reflection.distance);
        color += reflection.weight * mix(shaded, ambientRadiance(-reflection.point.view), reflection.faded);
    }
    return vec4(min(color, vec3(reflection.brightest)), reflection.met);
}

void opaquePixel(uvec2 pixel) {
    vec3 direction = cameraDirection(frame.camera, pixel);
    Surface surface;
    float distance;
    vec4 visibility = vec4(1.0);
    vec4 penumbra = vec4(0.0);
    vec4 reflected = vec4(0.0);
    if (readSurface(frame.opaqueDepth, frame.opaqueSurface, pixel, direction, surface, distance)) {
        Reflection reflection =
            reflectionOf(surface, direction, distance, spreadNoise(pixel, 2u), pixelNoise(pixel, 3u));
        vec3 origin = surface.position + surface.geometricNormal * liftAt(distance);
        LitPoint own = LitPoint(surface, -direction, origin, discPlace(spreadNoise(pixel, 0u)));
        vec4 blockers = vec4(-1.0);
        // First the pixel's own surface, then what it reflects, by the same call.
        [[dont_unroll]] for (uint i = 0u; i < 2u; ++i) {
            bool isSeen = i == 0u;
            if (!isSeen && reflection.weight <= 0.0) {
                break;
            }
            blockers = blockersOf(isSeen ? own : reflection.point, isSeen, spreadNoise(pixel, 1u));
            if (isSeen) {
                visibility = visibilityOf(blockers);
                penumbra = penumbrasOf(own, blockers, distance);
            }
        }
        reflected = litReflection(reflection, blockers);
    }
    imageStore(kImages2D[frame.visibility], ivec2(pixel), visibility);
    imageStore(kImages2D[frame.penumbra], ivec2(pixel), penumbra);
    imageStore(kImages2D[frame.reflection], ivec2(pixel), reflected);
}

// Only where the transparent g-buffer has something that the opaque one does not hide: its depth is the mask.
void transparentPixel(uvec2 pixel) {
    vec3 direction = cameraDirection(frame.camera, pixel);
    Surface surface;
    float distance;
    vec4 reflected = vec4(0.0);
    if (readSurface(frame.glassDepth, frame.glassSurface, pixel, direction, surface, distance)) {
        Reflection reflection = reflectionOf(surface, direction, distance, vec2(0.0), pixelNoise(pixel, 4u));
        vec4 blockers = vec4(-1.0);
        if (reflection.weight > 0.0) {
            blockers = blockersOf(reflection.point, false, vec2(0.0));
        }
        reflected = litReflection(reflection, blockers);
    }
    imageStore(kImages2D[frame.glassReflection], ivec2(pixel), reflected);
}

#endif
