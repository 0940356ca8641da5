#ifndef LVK_RAY_QUERY_GLSL
#define LVK_RAY_QUERY_GLSL

// Ray queries in any stage. The names are the same for traversal by the device and by the library.
//
//     LvkRayQuery rq;
//     lvkRayQueryInitialize(rq, tlas, LVK_RAY_FLAG_OPAQUE, 0xFFu, origin, 0.0, direction, 100.0);
//     while (lvkRayQueryProceed(rq)) {}
//     if (lvkRayQueryType(rq, LVK_COMMITTED) == LVK_COMMITTED_TRIANGLE) { float t = lvkRayQueryT(rq, LVK_COMMITTED); }
//
// A query is a local or global variable. Declare it, pass it to the functions below, and neither assign nor copy it.
// `which` is LVK_CANDIDATE (inside the loop) or LVK_COMMITTED (the closest hit so far), written as a constant.
// If the type of the committed hit is LVK_COMMITTED_NONE, its other values are undefined on devices. The library's own
// traversal returns the ray's tMax as the distance, and zeros for the rest.
// lvkRayQueryGenerateIntersection takes a distance from the ray's tMin to the closest hit so far (tMax without a hit),
// both included. Compare first: a device may do anything with others. The library's own traversal ignores them.
// `rq` and `which` may be evaluated more than once or not at all: pass plain names.
//
// A module whose rays treat triangles as opaque and meet no AABBs can define LVK_OPAQUE_TRIANGLES_ONLY before the
// include. All its rays have LVK_RAY_FLAG_OPAQUE, without candidates. The library's own traversal is much faster then.
// A module that has candidate triangles, but whose rays meet no AABBs, can define LVK_TRIANGLES_ONLY, a promise: where a
// ray does meet an AABB, the library's own traversal misses it, and a device does not.
//
// A module can define LVK_CANDIDATE_FUNCTION before the include, as the name of a function that judges candidates in
// place of the loop:
//
//     #define LVK_CANDIDATE_FUNCTION confirmSolid
//     #include <lvk/ray_query.glsl>
//     void confirmSolid(LvkRayQueryParameter rq) {
//         if (isSolid(lvkRayQueryInstanceCustomIndex(rq, LVK_CANDIDATE))) { lvkRayQueryConfirmIntersection(rq); }
//     }
//
// lvkRayQueryProceed then calls the function for each candidate of every ray of the module, and returns false. The
// function may use LVK_CANDIDATE and LVK_COMMITTED, confirm, generate and terminate, but trace no ray. The library's own
// traversal calls the function without leaving its loops, which is much faster.
//
// A module can define LVK_COUNT_TRAVERSAL_STEPS before the include. lvkTraversalSteps, a variable of each invocation, then
// counts the steps of its rays: nodes visited and primitives tested by the library's own traversal. Devices count none.
//
// The context chooses the traversal when it compiles the module: `rayQueryEXT`, or the library's own traversal if
// LVK_SOFTWARE_RAY_QUERY is defined (Capabilities::ray_query_path).

#ifdef LVK_OPAQUE_TRIANGLES_ONLY
#undef LVK_TRIANGLES_ONLY
#define LVK_TRIANGLES_ONLY
#define LVK_RAY_FLAGS_ALWAYS LVK_RAY_FLAG_OPAQUE
#else
#define LVK_RAY_FLAGS_ALWAYS LVK_RAY_FLAG_NONE
#endif

#define LVK_CANDIDATE false
#define LVK_COMMITTED true

// Values of lvkRayQueryType(rq, LVK_CANDIDATE).
#define LVK_CANDIDATE_TRIANGLE 0u
#define LVK_CANDIDATE_AABB 1u
// Values of lvkRayQueryType(rq, LVK_COMMITTED).
#define LVK_COMMITTED_NONE 0u
#define LVK_COMMITTED_TRIANGLE 1u
#define LVK_COMMITTED_GENERATED 2u

#ifdef LVK_COUNT_TRAVERSAL_STEPS
uint lvkTraversalSteps = 0u;
#endif

#ifdef LVK_SOFTWARE_RAY_QUERY
#include <lvk/software_ray_query.glsl>
#else
#include <lvk/hardware_ray_query.glsl>
#endif

#endif
