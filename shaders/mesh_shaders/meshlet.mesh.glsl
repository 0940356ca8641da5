// Puts out the corners and triangles of a meshlet.
#include "mesh_shaders/frame.glsl"
#include "mesh_shaders/payload.glsl"
const uint kInvocations = 32u;
layout(local_size_x = kInvocations) in;
layout(triangles, max_vertices = 64, max_primitives = 96) out;

taskPayloadSharedEXT Chosen chosen;
layout(location = 0) out vec3 position[];
layout(location = 1) out vec3 normal[];
layout(location = 2) perprimitiveEXT out uint meshletNumber[];

void main() {
    uint number = chosen.meshlets[gl_WorkGroupID.x];
    Meshlet meshlet = frame.meshlets.at[number];
    vec3 moved = movedBy(number);
    SetMeshOutputsEXT(meshlet.vertexCount, meshlet.triangleCount);
    for (uint i = gl_LocalInvocationIndex; i < meshlet.vertexCount; i += kInvocations) {
        Vertex corner = frame.vertices.at[frame.vertexNumbers.at[meshlet.firstVertex + i]];
        vec3 place = turned(corner.position + moved);
        position[i] = place;
        normal[i] = turned(corner.normal);
        gl_MeshVerticesEXT[i].gl_Position = cameraClip(frame.camera, place);
    }
    for (uint i = gl_LocalInvocationIndex; i < meshlet.triangleCount; i += kInvocations) {
        uint corners = frame.triangles.at[meshlet.firstTriangle + i];
        gl_PrimitiveTriangleIndicesEXT[i] = uvec3(corners, corners >> 8, corners >> 16) & 255u;
        meshletNumber[i] = number;
    }
}
