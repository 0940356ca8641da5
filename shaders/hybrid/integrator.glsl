// The light along a pixel's ray: Phong shading with shadow rays, mirror reflection and refraction to a depth,
// the cube map where a ray leaves the scene (algorithms 2 and 3 of Kim and Baek). The recursion is a loop over
// an explicit stack, so that a ray pipeline needs no recursion of its own and a ray query gives the same picture.
// The including file provides traceClosest() and traceOccluded().
#ifndef HYBRID_INTEGRATOR
#define HYBRID_INTEGRATOR

#include "hybrid/frame.glsl"
#include "common/fresnel.glsl"
#include "common/lighting.glsl"
#include "hybrid/hit.glsl"

// Reflections and refractions a ray may go through; deeper ones are black.
layout(constant_id = 0) const uint kMaxDepth = 4u;

// A hit pushes two rays at most and takes one back: one ray waits per level.
const uint kStackSize = kMaxDepth + 1u;

struct Ray {
    vec3 origin;
    float tmin;
    vec3 direction;
    float coneWidth; // footprint at the origin
    vec3 weight; // share of the pixel's colour
    uint depth;
};

SurfacePoint surfaceOf(Hit hit, Ray ray) {
    return surfaceAt(hit.triangle, hit.barycentrics, ray.origin, ray.direction, ray.coneWidth, frame.camera.pixelSpread,
                     frame.surfaceSampler);
}

Ray reflectedRay(Ray ray, SurfacePoint point, Facing facing, vec3 weight) {
    vec3 origin = leaveSurface(point.position, facing.geometricNormal, frame.offsetExtent);
    float width = ray.coneWidth + frame.camera.pixelSpread * point.distance;
    return Ray(origin, 0.0, mirroredDirection(ray.direction, facing), width, weight, ray.depth + 1u);
}

Ray refractedRay(Ray ray, SurfacePoint point, Facing facing, float eta, vec3 weight) {
    vec3 origin = leaveSurface(point.position, -facing.geometricNormal, frame.offsetExtent);
    float width = ray.coneWidth + frame.camera.pixelSpread * point.distance;
    return Ray(origin, 0.0, refractedDirection(ray.direction, facing, eta), width, weight, ray.depth + 1u);
}

// The rays that continue from a surface: weights of the mirrored and of the refracted ray, 0 for none.
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

// Light that the surface sends along the ray by itself.
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

// Adds the light along a ray, whose surface is `point` if `isMet`, and along all waiting rays. All trace in one place: in ray
// queries without hardware, each place is a traversal of its own.
void addLightAlong(Ray ray, bool isMet, SurfacePoint point, inout vec3 color) {
    while (true) {
        if (!isMet) {
            Hit hit = traceClosest(ray.origin, ray.tmin, ray.direction, kFar);
            isMet = hit.triangle != kNoTriangle;
            if (isMet) {
                point = surfaceOf(hit, ray);
            }
        }
        if (isMet) {
            Encounter met = encounterAt(ray, point);
            color += localLight(ray, met);
            pushBranches(ray, met);
        } else {
            color += ray.weight * skyColor(ray.direction);
        }
        if (waitingCount == 0u) {
            return;
        }
        ray = waiting[--waitingCount];
        isMet = false;
    }
}

// Adds the light along the rays that go on from a surface.
void addLightBeyond(Ray ray, SurfacePoint point, inout vec3 color) {
    waitingCount = 0u;
    pushBranches(ray, encounterAt(ray, point));
    if (waitingCount > 0u) {
        addLightAlong(waiting[--waitingCount], false, point, color);
    }
}

#endif
