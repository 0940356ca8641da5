#ifndef LVK_HIT_REMAP_GLSL
#define LVK_HIT_REMAP_GLSL

// Maps the ids of a hit to those of the application. If a mesh was split or its primitives were reordered, Vulkan
// counts the library's own instances and primitives. A hit remap table with an entry for each of these instances maps
// them back. A TLAS without such meshes has no table, and the ids are the same.
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
