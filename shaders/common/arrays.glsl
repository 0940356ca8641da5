// Arrays of vectors that shaders reach by device address.
#ifndef COMMON_ARRAYS
#define COMMON_ARRAYS

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Vec3Array { vec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Vec2Array { vec2 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer TriangleArray { uvec3 at[]; };

#endif
