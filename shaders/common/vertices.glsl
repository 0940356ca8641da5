// Vertices of meshes without texture coordinates, as `GpuVertex` in samples/src/shapes.rs has them.
#ifndef COMMON_VERTICES
#define COMMON_VERTICES

struct Vertex {
    vec3 position;
    vec3 normal;
};
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer VertexArray { Vertex at[]; };

#endif
