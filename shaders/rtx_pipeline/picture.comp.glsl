// A pixel by ray queries: a loop in place of the recursion, and the offset that leads to hit groups in place of them.
#define LVK_OPAQUE_TRIANGLES_ONLY
#include <lvk/ray_query.glsl>

#include "common/group_pixel.glsl"
#include "common/occlusion_query.glsl"
#include "rtx_pipeline/picture.glsl"
#include "rtx_pipeline/radiance.glsl"

bool traceOccluded(vec3 origin, float tmin, vec3 direction, float tmax) {
    return occludedByQuery(frame.tlas, kMaskSolid, origin, tmin, direction, tmax);
}

#include "rtx_pipeline/shade.glsl"

// The hit of the ray; false where the ray leaves the scene.
bool meets(Onward ray, out Shaded shaded) {
    LvkRayQuery query;
    lvkRayQueryInitialize(query, frame.tlas, LVK_RAY_FLAG_OPAQUE, kMaskAll, ray.origin, 0.0, ray.direction, kFar);
    while (lvkRayQueryProceed(query)) {
    }
    if (lvkRayQueryType(query, LVK_COMMITTED) == LVK_COMMITTED_NONE) {
        return false;
    }
    uint firstTriangle = uint(lvkRayQueryInstanceCustomIndex(query, LVK_COMMITTED));
    uint triangle = firstTriangle + uint(lvkRayQueryPrimitiveIndex(query, LVK_COMMITTED, frame.tlas));
    SurfacePoint point =
        pointOf(triangle, lvkRayQueryBarycentrics(query, LVK_COMMITTED), ray.origin, ray.direction, ray.cone);
    bool isGlass = uint(lvkRayQueryInstanceShaderBindingTableRecordOffset(query, LVK_COMMITTED)) == kGlass;
    if (isGlass) {
        shaded = shadeGlass(point, ray.direction, ray.cone);
    } else {
        shaded = shadeSolid(point, ray.direction, ray.cone);
    }
    return true;
}

vec3 lightAlong(Onward ray) {
    vec3 light = vec3(0.0);
    vec3 weight = ray.weight;
    for (uint depth = 0u;; ++depth) {
        Shaded shaded;
        if (!meets(ray, shaded)) {
            return light + weight * skyColor(ray.direction);
        }
        light += weight * shaded.light;
        if (!isFollowed(shaded.onward, depth)) {
            return light;
        }
        ray = shaded.onward;
        weight *= ray.weight;
    }
}

void main() {
    uvec2 first = groupPixel();
    [[dont_unroll]] for (uint i = 0u; i < kGroupPixels; ++i) {
        uvec2 pixel = first + groupStep(i);
        if (pixel.x < frame.camera.width && pixel.y < frame.camera.height) {
            Onward ray = Onward(vec3(1.0), frame.camera.eye, cameraDirection(frame.camera, pixel), 0.0);
            store(pixel, lightAlong(ray));
        }
    }
}
