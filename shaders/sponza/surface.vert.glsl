// Corners of the draws that the camera sees, by number.
#include "sponza/frame.glsl"

layout(location = 0) out vec3 outPosition;
layout(location = 1) out vec3 outNormal;
layout(location = 2) out vec2 outTexcoord;
layout(location = 3) flat out uint outMaterial;

void main() {
    uint vertex = vertexAt(uint(gl_VertexIndex));
    outPosition = frame.scene.positions.at[vertex];
    outNormal = frame.scene.normals.at[vertex];
    outTexcoord = frame.scene.texcoords.at[vertex];
    outMaterial = materialAt(uint(gl_VertexIndex));
    gl_Position = cameraClip(frame.camera, outPosition);
}
