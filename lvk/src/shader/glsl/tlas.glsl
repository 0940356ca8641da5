#ifndef LVK_TLAS_GLSL
#define LVK_TLAS_GLSL

#include <lvk/ray_flags.glsl>

layout(set = LVK_SET, binding = LVK_BINDING_ACCEL_STRUCTS) uniform accelerationStructureEXT kTLAS[];

#endif
