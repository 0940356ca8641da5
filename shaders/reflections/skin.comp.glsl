// Skinning: moves the vertices of a mesh at rest by their bones, into the buffers that the refit reads.

layout(local_size_x = 64) in;

#include "common/octahedral.glsl"

struct RestVertex {
    vec3 position;
    vec3 normal;
    uint bones; // two numbers of 16 bits
    float weight; // of the second bone
};

struct Bone {
    vec4 rows[3]; // from the mesh at rest to the world
};

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer RestVertices { RestVertex at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Bones { Bone at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Positions { vec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Normals { uint at[]; };

layout(push_constant, scalar) uniform Push {
    RestVertices rest;
    Bones bones;
    Positions positions;
    Normals normals;
    uint vertexCount;
};

void main() {
    uint vertex = gl_GlobalInvocationID.x;
    if (vertex >= vertexCount) {
        return;
    }
    RestVertex v = rest.at[vertex];
    Bone first = bones.at[v.bones & 0xffffu];
    Bone second = bones.at[v.bones >> 16u];
    vec4 p = vec4(v.position, 1.0);
    vec3 position;
    vec3 normal;
    for (int axis = 0; axis < 3; ++axis) {
        vec4 row = mix(first.rows[axis], second.rows[axis], v.weight);
        position[axis] = dot(row, p);
        normal[axis] = dot(row.xyz, v.normal);
    }
    positions.at[vertex] = position;
    normals.at[vertex] = packSnorm2x16(octahedralFromUnit(normalize(normal)));
}
