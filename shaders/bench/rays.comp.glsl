// Primary rays by query, or with BENCH_SHADOW those towards the light, or with BENCH_BOUNCE those that go on from their hits.
#define LVK_OPAQUE_TRIANGLES_ONLY
#include <lvk/ray_query.glsl>
#include "common/group_pixel.glsl"
#include "bench/view.glsl"

#ifdef BENCH_SHADOW
void trace(uvec2 pixel, uint index) {
    float t = hits.at[index].t;
    lit.at[index] = 0u;
    if (t == kNoHit) {
        return;
    }
    vec3 point = pixelPoint(pixel, t);
    LvkRayQuery rq;
    uint flags = LVK_RAY_FLAG_OPAQUE | LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT;
    lvkRayQueryInitialize(rq, tlas, flags, 0xffu, point, 0.0, light - point, 1.0);
    while (lvkRayQueryProceed(rq)) {}
    lit.at[index] = lvkRayQueryType(rq, LVK_COMMITTED) == LVK_COMMITTED_NONE ? 1u : 0u;
}
#else
Hit nearest(vec3 origin, vec3 direction) {
    LvkRayQuery rq;
    lvkRayQueryInitialize(rq, tlas, LVK_RAY_FLAG_OPAQUE, 0xffu, origin, 0.0, direction, kFar);
    while (lvkRayQueryProceed(rq)) {}
    Hit hit = Hit(kNoHit, 0u);
    if (lvkRayQueryType(rq, LVK_COMMITTED) == LVK_COMMITTED_TRIANGLE) {
        hit = Hit(lvkRayQueryT(rq, LVK_COMMITTED), uint(lvkRayQueryPrimitiveIndex(rq, LVK_COMMITTED, tlas)));
    }
    return hit;
}

#ifdef BENCH_BOUNCE
void trace(uvec2 pixel, uint index) {
    BounceRay ray = bounceRays.at[index];
    if (ray.direction != vec3(0.0)) {
        bounceHits.at[index] = nearest(ray.origin, ray.direction);
    }
}
#else
void trace(uvec2 pixel, uint index) {
    hits.at[index] = nearest(eye, pixelDirection(pixel));
}
#endif
#endif

void main() {
    uvec2 first = groupPixel();
    [[dont_unroll]] for (uint i = 0u; i < kGroupPixels; ++i) {
        uvec2 pixel = first + groupStep(i);
        if (pixel.x < width && pixel.y < height) {
            trace(pixel, pixel.y * width + pixel.x);
        }
    }
}
