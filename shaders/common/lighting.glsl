// The light of surfaces, and where mirrors and glass send rays on: what every tracer of scenes shares.
// The including file provides `frame` before, with camera, scene, lights, sky and samplers, and traceOccluded().
#ifndef COMMON_LIGHTING
#define COMMON_LIGHTING

#include "common/phong.glsl"
#include "common/ray_offset.glsl"
#include "common/surface.glsl"

// Rays that would add less than this to a pixel are not traced.
const float kSmallestWeight = 1.0 / 512.0;
const float kFar = 1e30;

// A surface point seen from one side.
struct Facing {
    vec3 normal; // on the ray's side
    vec3 geometricNormal; // on the ray's side
    bool entering; // the ray comes from outside
};

Facing faceRay(SurfacePoint point, vec3 direction) {
    Facing facing;
    facing.entering = dot(point.geometricNormal, direction) < 0.0;
    float side = facing.entering ? 1.0 : -1.0;
    facing.geometricNormal = side * point.geometricNormal;
    vec3 n = side * point.normal;
    // An interpolated normal may look away from the viewer near a silhouette: bend it until it is edge-on.
    float away = dot(n, direction);
    facing.normal = away > -1e-3 ? normalize(n - direction * (away + 1e-3)) : n;
    return facing;
}

// The sky, for rays that leave the scene.
vec3 skyColor(vec3 direction) {
    return textureBindlessCubeLod(frame.sky, frame.skySampler, direction, 0.0).rgb;
}

// Light of one source at the point, were nothing in between; the way to it in `toLight` and `distance`.
vec3 arrivingLight(Light light, vec3 position, out vec3 toLight, out float distance) {
    if (light.isDistant != 0.0) {
        toLight = light.position;
        distance = kFar;
        return light.color;
    }
    vec3 way = light.position - position;
    distance = max(length(way), 1e-20);
    toLight = way / distance;
    float relative = distance / light.reach;
    return light.color / (1.0 + relative * relative);
}

// Light that the surface sends towards `view` by itself: emission, ambient light and that of visible sources.
vec3 shadeLocally(SurfacePoint point, Facing facing, Material material, vec3 view) {
    float above = 0.5 + 0.5 * facing.normal.y;
    vec3 color = material.emission + point.albedo * mix(frame.ambientBelow, frame.ambientAbove, above);
    vec3 origin = leaveSurface(point.position, facing.geometricNormal, frame.offsetExtent);
    for (uint i = 0u; i < frame.lightCount; ++i) {
        vec3 toLight;
        float distance;
        vec3 light = arrivingLight(frame.lights[i], origin, toLight, distance);
        if (dot(toLight, facing.geometricNormal) <= 0.0 || dot(toLight, facing.normal) <= 0.0) {
            continue;
        }
        if (!traceOccluded(origin, 0.0, toLight, distance * 0.9999)) {
            color += light *
                     phong(point.albedo, material.specular, material.shininess, facing.normal, view, toLight);
        }
    }
    return color;
}

vec3 mirroredDirection(vec3 direction, Facing facing) {
    vec3 mirrored = reflect(direction, facing.normal);
    // A bent normal may mirror a ray into its own surface: keep it just above.
    float below = dot(mirrored, facing.geometricNormal);
    if (below < 1e-3) {
        mirrored = mirrored + facing.geometricNormal * (1e-3 - below);
    }
    return normalize(mirrored);
}

// `eta`: index of refraction on the ray's side over the one beyond.
vec3 refractedDirection(vec3 direction, Facing facing, float eta) {
    vec3 refracted = refract(direction, facing.normal, eta);
    float above = dot(refracted, facing.geometricNormal);
    if (above > -1e-3) {
        refracted = refracted - facing.geometricNormal * (above + 1e-3);
    }
    return normalize(refracted);
}

#endif
