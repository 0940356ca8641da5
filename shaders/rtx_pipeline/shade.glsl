// Shading in the hit groups: the light that the surface sends by itself, and the one ray that continues from there.
// The including file provides traceOccluded().
#ifndef RTX_PIPELINE_SHADE
#define RTX_PIPELINE_SHADE

#include "common/fresnel.glsl"
#include "common/lighting.glsl"
#include "rtx_pipeline/radiance.glsl"

// A ray that goes on from a surface, and the share of its light that counts.
struct Onward {
    vec3 weight;
    vec3 origin;
    vec3 direction;
    float cone; // its footprint where it starts
};

struct Shaded {
    vec3 light;
    Onward onward;
};

Material materialOf(uint triangle) {
    return frame.scene.materials.at[frame.scene.triangleInfos.at[triangle].material];
}

bool isFollowed(Onward onward, uint depth) {
    return depth < frame.depth && max(onward.weight.x, max(onward.weight.y, onward.weight.z)) >= kSmallestWeight;
}

SurfacePoint pointOf(uint triangle, vec2 barycentrics, vec3 origin, vec3 direction, float cone) {
    return surfaceAt(triangle, barycentrics, origin, direction, cone, frame.camera.pixelSpread, frame.surfaceSampler);
}

// Hit group kSolid: what the light makes of it, and a mirrored ray from what is polished.
Shaded shadeSolid(SurfacePoint point, vec3 direction, float cone) {
    Material material = materialOf(point.triangle);
    Facing facing = faceRay(point, direction);
    Shaded shaded;
    shaded.light = (1.0 - material.reflectivity) * shadeLocally(point, facing, material, -direction);
    shaded.onward.weight = material.reflectivity * material.tint;
    shaded.onward.origin = leaveSurface(point.position, facing.geometricNormal, frame.offsetExtent);
    shaded.onward.direction = mirroredDirection(direction, facing);
    shaded.onward.cone = cone + frame.camera.pixelSpread * point.distance;
    return shaded;
}

// Hit group kGlass: it bends the ray, and mirrors nothing but the sky.
Shaded shadeGlass(SurfacePoint point, vec3 direction, float cone) {
    Material material = materialOf(point.triangle);
    Facing facing = faceRay(point, direction);
    float eta = facing.entering ? 1.0 / material.ior : material.ior;
    float mirrored = fresnelDielectric(dot(facing.normal, -direction), eta);
    bool turnsBack = mirrored == 1.0;
    float share = 1.0 - material.transmission - material.reflectivity;
    Shaded shaded;
    shaded.light = share > 0.0 ? share * shadeLocally(point, facing, material, -direction) : vec3(0.0);
    if (facing.entering) {
        float sheen = material.transmission * mirrored + material.reflectivity;
        shaded.light += sheen * material.tint * skyColor(mirroredDirection(direction, facing));
    }
    vec3 side = turnsBack ? facing.geometricNormal : -facing.geometricNormal;
    shaded.onward.weight = material.transmission * (turnsBack || !facing.entering ? 1.0 : 1.0 - mirrored) * material.tint;
    shaded.onward.origin = leaveSurface(point.position, side, frame.offsetExtent);
    shaded.onward.direction =
        turnsBack ? mirroredDirection(direction, facing) : refractedDirection(direction, facing, eta);
    shaded.onward.cone = cone + frame.camera.pixelSpread * point.distance;
    return shaded;
}

#endif
