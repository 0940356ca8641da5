#ifndef LVK_RAY_TRACING_GLSL
#define LVK_RAY_TRACING_GLSL

// Part of the preamble of every ray tracing stage: kTLAS for traceRayEXT and the LVK_RAY_FLAG_* constants.
#ifndef LVK_STAGE_RAY_TRACING
#error <lvk/ray_tracing.glsl> is for ray tracing stages; other stages trace with <lvk/ray_query.glsl>
#endif
#include <lvk/tlas.glsl>

#endif
