// The corners of everything solid.
#include "deferred/frame.glsl"

layout(location = 0) out vec3 position;
layout(location = 1) out vec3 normal;
layout(location = 2) flat out uint material;

void main() {
    Vertex vertex = frame.vertices.at[gl_VertexIndex];
    gl_Position = cameraClip(frame.camera, vertex.position);
    position = vertex.position;
    normal = vertex.normal;
    material = vertex.material;
}
