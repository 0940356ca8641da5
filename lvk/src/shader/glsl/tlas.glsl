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
#define LVK_RAY_FLAG_SKIP_TRIANGLES 0x100u
#define LVK_RAY_FLAG_SKIP_AABBS 0x200u

// From what a ray hit to the numbers the application gave. Where a mesh was split, or its primitives were put into
// another order, the instances and primitives that Vulkan counts are the library's own: a row for each of Vulkan's
// instances leads back. A structure without such meshes has no rows, and the numbers are the same.
struct LvkTlasRow { uvec2 map; uint instance; uint unused; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer LvkTlasRows { LvkTlasRow row[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LvkPrimitiveMap { uint word[]; };
layout(set = LVK_SET, binding = LVK_BINDING_TLAS_TABLE, scalar) readonly buffer LvkTlasTable { uvec2 rows[]; } kLvkTlasTable;

int lvkMapInstance(uint tlas, int instance) {
    uvec2 rows = kLvkTlasTable.rows[tlas];
    return rows == uvec2(0) ? instance : int(LvkTlasRows(rows).row[instance].instance);
}

int lvkMapPrimitive(uint tlas, int instance, int geometry, int primitive) {
    uvec2 rows = kLvkTlasTable.rows[tlas];
    if (rows == uvec2(0)) return primitive;
    uvec2 map = LvkTlasRows(rows).row[instance].map;
    if (map == uvec2(0)) return primitive;
    return int(LvkPrimitiveMap(map).word[LvkPrimitiveMap(map).word[geometry] + uint(primitive)]);
}

#endif
