#ifndef LVK_HIT_NUMBERS_GLSL
#define LVK_HIT_NUMBERS_GLSL

// From what a ray hit to the numbers the application gave. Where a mesh was split, or its primitives were put into
// another order, the instances and primitives that Vulkan counts are the library's own: a row for each of Vulkan's
// instances leads back. A structure without such meshes has no rows, and the numbers are the same.
#include <lvk/tlas_table.glsl>
struct LvkTlasRow { uvec2 map; uint instance; uint unused; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer LvkTlasRows { LvkTlasRow row[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LvkPrimitiveMap { uint word[]; };

int lvkMapInstance(uint tlas, int instance) {
    uvec2 rows = kLvkTlasTable.entry[tlas].rows;
    return rows == uvec2(0) ? instance : int(LvkTlasRows(rows).row[instance].instance);
}

int lvkMapPrimitive(uint tlas, int instance, int geometry, int primitive) {
    uvec2 rows = kLvkTlasTable.entry[tlas].rows;
    if (rows == uvec2(0)) return primitive;
    uvec2 map = LvkTlasRows(rows).row[instance].map;
    if (map == uvec2(0)) return primitive;
    return int(LvkPrimitiveMap(map).word[LvkPrimitiveMap(map).word[geometry] + uint(primitive)]);
}

#endif
