#ifndef LVK_TLAS_GLSL
#define LVK_TLAS_GLSL

layout(set = LVK_SET, binding = LVK_BINDING_ACCEL_STRUCTS) uniform accelerationStructureEXT kTLAS[];

#define LVK_RAY_FLAG_NONE 0x0u
#define LVK_RAY_FLAG_OPAQUE 0x1u
#define LVK_RAY_FLAG_NO_OPAQUE 0x2u
#define LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT 0x4u
#define LVK_RAY_FLAG_SKIP_CLOSEST_HIT_SHADER 0x8u
#define LVK_RAY_FLAG_CULL_BACK_FACING_TRIANGLES 0x10u
#define LVK_RAY_FLAG_CULL_FRONT_FACING_TRIANGLES 0x20u
#define LVK_RAY_FLAG_CULL_OPAQUE 0x40u
#define LVK_RAY_FLAG_CULL_NO_OPAQUE 0x80u
// Shaders that skip by kind require GL_EXT_ray_flags_primitive_culling and say layout(primitive_culling);
#define LVK_RAY_FLAG_SKIP_TRIANGLES 0x100u
#define LVK_RAY_FLAG_SKIP_AABBS 0x200u

#endif
