#ifndef LVK_TLAS_TABLE_GLSL
#define LVK_TLAS_TABLE_GLSL

// What the library knows of each element of kTLAS[].
struct LvkTlasEntry {
    uvec2 rows;     // where the rows of its instances lie; 0 without them, see <lvk/hit_numbers.glsl>
    uvec2 software; // where the structure lies that software traces; 0 without one
};
layout(set = LVK_SET, binding = LVK_BINDING_TLAS_TABLE, scalar) readonly buffer LvkTlasTable { LvkTlasEntry entry[]; } kLvkTlasTable;

#endif
