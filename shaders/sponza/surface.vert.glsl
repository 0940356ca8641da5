// Corners of the draws that the camera sees, by number.
#include "sponza/frame.glsl"

layout(location = 0) out vec3 outPosition;
layout(location = 1) out vec3 outNormal;
layout(location = 2) out vec2 outTexcoord;
layout(location = 3) flat out uint outMaterial;
layout(location = 4) out vec3 outColor;

void main() {
    uint vertex = vertexAt(uint(gl_VertexIndex));
    outPosition = frame.scene.positions.at[vertex];
    outNormal = frame.scene.normals.at[vertex];
    outTexcoord = frame.scene.texcoords.at[vertex];
    outMaterial = materialAt(uint(gl_VertexIndex));
    outColor = frame.scene.colors == uvec2(0u) ? vec3(1.0) : Vec3Array(frame.scene.colors).at[vertex];
    gl_Position = cameraClip(frame.camera, outPosition);
}
