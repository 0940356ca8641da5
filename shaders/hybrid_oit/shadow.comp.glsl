// Sunlight by ray queries: what intersection, any-hit and miss shader do, in one loop.
#include <lvk/ray_query.glsl>

#include "common/group_pixel.glsl"
#include "hybrid_oit/sphere.glsl"

vec3 traceSunlight(vec3 origin, vec3 direction) {
    LvkRayQuery rq;
    lvkRayQueryInitialize(rq, frame.tlas, LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT, 0xffu, origin, 0.0, direction, 1e4);
    uvec3 opticalDepth = uvec3(0u);
    while (lvkRayQueryProceed(rq)) {
        // Floor and blocks are opaque and commit themselves.
        if (lvkRayQueryType(rq, LVK_CANDIDATE) != LVK_CANDIDATE_AABB) {
            continue;
        }
        uint first = uint(lvkRayQueryInstanceCustomIndex(rq, LVK_CANDIDATE));
        Sphere sphere = frame.spheres.at[first + uint(lvkRayQueryPrimitiveIndex(rq, LVK_CANDIDATE, frame.tlas))];
        Crossing crossing;
        if (!crossSphere(sphere.center, sphere.radius, origin, direction, crossing)) {
            continue;
        }
        if (sphere.isGlass != 0u) {
            opticalDepth += glassOpticalDepth(crossing, sphere.color, 0.0);
        } else {
            lvkRayQueryGenerateIntersection(rq, crossing.entry >= 0.0 ? crossing.entry : crossing.exit);
        }
    }
    bool isBlocked = lvkRayQueryType(rq, LVK_COMMITTED) != LVK_COMMITTED_NONE;
    return isBlocked ? vec3(0.0) : transmittanceOf(opticalDepth);
}

#include "hybrid_oit/shadow.glsl"

void main() {
    uvec2 first = groupPixel();
    [[dont_unroll]] for (uint i = 0u; i < kGroupPixels; ++i) {
        uvec2 pixel = first + groupStep(i);
        if (pixel.x < frame.camera.width && pixel.y <= frame.camera.height) {
            shadowAt(pixel);
        }
    }
}
