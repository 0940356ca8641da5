#ifndef LVK_RAY_QUERY_GLSL
#define LVK_RAY_QUERY_GLSL

// Ray queries in any stage, under names that do not depend on who walks the tree.
//
//     LvkRayQuery rq;
//     lvkRayQueryInitialize(rq, tlas, LVK_RAY_FLAG_OPAQUE, 0xFFu, origin, 0.0, direction, 100.0);
//     while (lvkRayQueryProceed(rq)) {}
//     if (lvkRayQueryType(rq, LVK_COMMITTED) == LVK_COMMITTED_TRIANGLE) { float t = lvkRayQueryT(rq, LVK_COMMITTED); }
//
// A query is a local or global variable: declare it, hand it to the functions below, and neither assign nor copy it.
// `which` is LVK_CANDIDATE (inside the loop) or LVK_COMMITTED (the closest hit so far), written as a constant.
// Where the type of the committed hit is LVK_COMMITTED_NONE, ask for nothing else of it: a device may answer anything. The
// library's own walk answers the ray's tMax as the distance, and zeros.
// lvkRayQueryGenerateIntersection wants a distance from the ray's tMin to the closest hit so far, or to tMax where there is none,
// both included: compare before, as a device may do anything with others. The library's own walk leaves them out.
// `rq` and `which` may be evaluated more than once or not at all: pass plain names.
//
// A module whose rays take all triangles for opaque and meet no boxes defines LVK_OPAQUE_TRIANGLES_ONLY before the include:
// all its rays have LVK_RAY_FLAG_OPAQUE, and there are no candidates. The library walks much faster then.
//
// The context decides who walks the tree when the module is compiled: `rayQueryEXT`, or the library itself where
// LVK_SOFTWARE_RAY_QUERY is defined (Capabilities::ray_query_path).

#ifdef LVK_OPAQUE_TRIANGLES_ONLY
#define LVK_RAY_FLAGS_ALWAYS LVK_RAY_FLAG_OPAQUE
#else
#define LVK_RAY_FLAGS_ALWAYS LVK_RAY_FLAG_NONE
#endif

#define LVK_CANDIDATE false
#define LVK_COMMITTED true

// lvkRayQueryType(rq, LVK_CANDIDATE)
#define LVK_CANDIDATE_TRIANGLE 0u
#define LVK_CANDIDATE_AABB 1u
// lvkRayQueryType(rq, LVK_COMMITTED)
#define LVK_COMMITTED_NONE 0u
#define LVK_COMMITTED_TRIANGLE 1u
#define LVK_COMMITTED_GENERATED 2u

#ifdef LVK_SOFTWARE_RAY_QUERY
#include <lvk/software_ray_query.glsl>
#else
#include <lvk/hardware_ray_query.glsl>
#endif

#endif
