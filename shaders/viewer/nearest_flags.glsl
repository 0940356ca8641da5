// Ray flags of a ray that looks for the nearest surface.
#ifndef VIEWER_NEAREST_FLAGS
#define VIEWER_NEAREST_FLAGS

#include "viewer/hit.glsl"

// `seed`: of nearestSeed(). The eye does not see backs, but of instances that have double-sided surfaces.
uint nearestFlags(uint seed) {
    return (seed & kFromEye) != 0u ? LVK_RAY_FLAG_CULL_BACK_FACING_TRIANGLES : LVK_RAY_FLAG_NONE;
}

#endif
