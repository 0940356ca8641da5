// The light along a pixel's ray: Phong shading with shadow rays, mirror reflection and refraction to a depth,
// the cube map where a ray leaves the scene (algorithms 2 and 3 of Kim and Baek). The recursion is a loop over
// an explicit stack, so that a ray pipeline needs no recursion of its own and a ray query gives the same picture.
// The including file provides traceClosest() and traceOccluded().
#ifndef HYBRID_INTEGRATOR
#define HYBRID_INTEGRATOR

#include "hybrid/frame.glsl"
#include "common/fresnel.glsl"
#include "common/phong.glsl"
#include "common/ray_offset.glsl"
#include "common/surface.glsl"
#include "hybrid/hit.glsl"

// Reflections and refractions a ray may go through; deeper ones are black.
layout(constant_id = 0) const uint kMaxDepth = 4u;

// A hit pushes two rays at most and takes one back: one ray waits per level.
const uint kStackSize = kMaxDepth + 1u;

// What adds less than this to a pixel is not followed.
const float kSmallestWeight = 1.0 / 512.0;
const float kFar = 1e30;

struct Ray {
    vec3 origin;
    float tmin;
    vec3 direction;
    float coneWidth; // footprint at the origin
    vec3 weight; // share of the pixel's colour
    uint depth;
};

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

SurfacePoint surfaceOf(Hit hit, Ray ray) {
    return surfaceAt(hit.triangle, hit.barycentrics, ray.origin, ray.direction, ray.coneWidth, frame.camera.pixelSpread,
                     frame.surfaceSampler);
}

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

Ray reflectedRay(Ray ray, SurfacePoint point, Facing facing, vec3 weight) {
    vec3 direction = reflect(ray.direction, facing.normal);
    // A bent normal may mirror a ray into its own surface: keep it just above.
    float below = dot(direction, facing.geometricNormal);
    if (below < 1e-3) {
        direction = direction + facing.geometricNormal * (1e-3 - below);
    }
    vec3 origin = leaveSurface(point.position, facing.geometricNormal, frame.offsetExtent);
    float width = ray.coneWidth + frame.camera.pixelSpread * point.distance;
    return Ray(origin, 0.0, normalize(direction), width, weight, ray.depth + 1u);
}

Ray refractedRay(Ray ray, SurfacePoint point, Facing facing, float eta, vec3 weight) {
    vec3 direction = refract(ray.direction, facing.normal, eta);
    float above = dot(direction, facing.geometricNormal);
    if (above > -1e-3) {
        direction = direction - facing.geometricNormal * (above + 1e-3);
    }
    vec3 origin = leaveSurface(point.position, -facing.geometricNormal, frame.offsetExtent);
    float width = ray.coneWidth + frame.camera.pixelSpread * point.distance;
    return Ray(origin, 0.0, normalize(direction), width, weight, ray.depth + 1u);
}

// What goes on from a surface: the weights of the mirrored and of the refracted ray, 0 where none is followed.
struct Branches {
    vec3 reflected;
    vec3 refracted;
    float eta; // index of refraction on the ray's side over that on the other
};

// A surface that a ray meets, and all that decides about its light.
struct Encounter {
    SurfacePoint point;
    Facing facing;
    Material material;
    Branches branches;
};

vec3 unlessNegligible(vec3 weight) {
    return max(weight.x, max(weight.y, weight.z)) < kSmallestWeight ? vec3(0.0) : weight;
}

Branches branchesAt(Ray ray, Facing facing, Material material) {
    Branches branches = Branches(vec3(0.0), vec3(0.0), facing.entering ? 1.0 / material.ior : material.ior);
    if (ray.depth < kMaxDepth) {
        float glass = material.transmission;
        float fresnel = glass > 0.0 ? fresnelDielectric(dot(facing.normal, -ray.direction), branches.eta) : 0.0;
        vec3 weight = ray.weight * material.tint;
        branches.reflected = unlessNegligible(weight * (material.reflectivity + glass * fresnel));
        branches.refracted = unlessNegligible(weight * (glass * (1.0 - fresnel)));
    }
    return branches;
}

bool goesOn(Branches branches) {
    return branches.reflected != vec3(0.0) || branches.refracted != vec3(0.0);
}

Encounter encounterAt(Ray ray, SurfacePoint point) {
    Material material = frame.scene.materials.at[frame.scene.triangleInfos.at[point.triangle].material];
    Facing facing = faceRay(point, ray.direction);
    return Encounter(point, facing, material, branchesAt(ray, facing, material));
}

// What the surface sends along the ray by itself.
vec3 localLight(Ray ray, Encounter met) {
    float share = max(1.0 - met.material.reflectivity - met.material.transmission, 0.0);
    return share > 0.0 ? ray.weight * share * shadeLocally(met.point, met.facing, met.material, -ray.direction)
                       : vec3(0.0);
}

Ray waiting[kStackSize];
uint waitingCount;

void pushBranches(Ray ray, Encounter met) {
    Branches branches = met.branches;
    if (branches.reflected != vec3(0.0)) {
        waiting[waitingCount++] = reflectedRay(ray, met.point, met.facing, branches.reflected);
    }
    if (branches.refracted != vec3(0.0)) {
        waiting[waitingCount++] = refractedRay(ray, met.point, met.facing, branches.eta, branches.refracted);
    }
}

// `color` and the light along all waiting rays.
vec3 followWaiting(vec3 color) {
    while (waitingCount > 0u) {
        Ray ray = waiting[--waitingCount];
        Hit hit = traceClosest(ray.origin, ray.tmin, ray.direction, kFar);
        if (hit.triangle != kNoTriangle) {
            Encounter met = encounterAt(ray, surfaceOf(hit, ray));
            color += localLight(ray, met);
            pushBranches(ray, met);
        } else {
            color += ray.weight * skyColor(ray.direction);
        }
    }
    return color;
}

#endif
