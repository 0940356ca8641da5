// Rays that look for the nearest surface. The including file provides traceWithin().
#ifndef VIEWER_NEAREST_RAY
#define VIEWER_NEAREST_RAY

#include "viewer/hit.glsl"

// The nearest surface up to `range` away, at the distance `range` where there is none. A ray from the eye sees no back of a single-sided
// surface. Where it meets one all the same, it is traced once more, and judges all triangles on its way one by one. `random`: by which
// surfaces are met that cover a share of light. `rayCount`: grows by the rays traced.
Hit nearestHit(vec3 origin, vec3 direction, float range, uint random, bool isFromEye, inout uint rayCount) {
    uint seed = nearestSeed(random);
    uint flags = isFromEye ? LVK_RAY_FLAG_CULL_BACK_FACING_TRIANGLES : LVK_RAY_FLAG_NONE;
    Hit hit;
    bool isDone = false;
    while (!isDone) {
        rayCount += 1u;
        hit = traceWithin(origin, direction, range, seed, flags);
        isDone = !isFromEye || (seed & kJudgesBacks) != 0u || !isUnseenBack(hit, direction);
        seed |= kJudgesBacks;
        flags |= LVK_RAY_FLAG_NO_OPAQUE;
    }
    return hit;
}

#endif
