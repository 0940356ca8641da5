// Sunlight by ray queries: what intersection and any-hit shader do, in one function.
#define LVK_CANDIDATE_FUNCTION crossCandidate
#include <lvk/ray_query.glsl>

#include "common/group_pixel.glsl"
#include "hybrid_oit/sphere.glsl"

// Of the glass that the ray has crossed so far.
uvec3 opticalDepth;

// Floor and blocks are opaque and commit themselves.
void crossCandidate(LvkRayQueryParameter rq) {
    if (lvkRayQueryType(rq, LVK_CANDIDATE) != LVK_CANDIDATE_AABB) {
        return;
    }
    uint first = uint(lvkRayQueryInstanceCustomIndex(rq, LVK_CANDIDATE));
    Sphere sphere = frame.spheres.at[first + uint(lvkRayQueryPrimitiveIndex(rq, LVK_CANDIDATE, frame.tlas))];
    vec3 origin = lvkRayQueryWorldRayOrigin(rq);
    Crossing crossing;
    if (!crossSphere(sphere.center, sphere.radius, origin, lvkRayQueryWorldRayDirection(rq), crossing)) {
        return;
    }
    if (sphere.isGlass != 0u) {
        opticalDepth += glassOpticalDepth(crossing, sphere.color, 0.0);
    } else {
        lvkRayQueryGenerateIntersection(rq, crossing.entry >= 0.0 ? crossing.entry : crossing.exit);
    }
}

vec3 traceSunlight(vec3 origin, vec3 direction) {
    LvkRayQuery rq;
    lvkRayQueryInitialize(rq, frame.tlas, LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT, 0xffu, origin, 0.0, direction, 1e4);
    opticalDepth = uvec3(0u);
    while (lvkRayQueryProceed(rq)) {
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
