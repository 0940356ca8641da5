#ifndef LVK_RAY_TRACING_GLSL
#define LVK_RAY_TRACING_GLSL

// Part of the preamble of every ray tracing stage: kTLAS for traceRayEXT, the LVK_RAY_FLAG_* constants, and the ids of
// the hit.
#ifndef LVK_STAGE_RAY_TRACING
#error <lvk/ray_tracing.glsl> is for ray tracing stages; other stages trace with <lvk/ray_query.glsl>
#endif
#include <lvk/tlas.glsl>

#if defined(LVK_STAGE_CLOSEST_HIT) || defined(LVK_STAGE_ANY_HIT) || defined(LVK_STAGE_INTERSECTION)
#include <lvk/hit_remap.glsl>
// The application's own ids of the hit in kTLAS[tlas]: the index of the instance, of the geometry and of the primitive.
// Use them instead of gl_InstanceID and gl_PrimitiveID, which count the parts of split and reordered meshes.
int lvkInstanceId(uint tlas) { return lvkMapInstance(tlas, gl_InstanceID); }
int lvkGeometryIndex() { return gl_GeometryIndexEXT; }
int lvkPrimitiveIndex(uint tlas) { return lvkMapPrimitive(tlas, gl_InstanceID, gl_GeometryIndexEXT, gl_PrimitiveID); }
#endif

#endif
