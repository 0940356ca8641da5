#ifndef LVK_TLAS_TABLE_GLSL
#define LVK_TLAS_TABLE_GLSL

// The library's data of each element of kTLAS[].
struct LvkTlasEntry {
    uvec2 rows;     // address of the hit remap table of its instances; 0 without one, see <lvk/hit_remap.glsl>
    uvec2 software; // address of the acceleration structure for software traversal; 0 without one
};
layout(set = LVK_SET, binding = LVK_BINDING_TLAS_TABLE, scalar) readonly buffer LvkTlasTable { LvkTlasEntry entry[]; } kLvkTlasTable;

#endif
