// Corners of the draws that the camera sees, by number.
#include "sponza/frame.glsl"

layout(location = 0) out vec3 outPosition;
layout(location = 1) out vec3 outNormal;
layout(location = 2) out vec2 outTexcoord;
layout(location = 3) flat out uint outMaterial;

void main() {
    uint triangle = uint(gl_VertexIndex) / 3u;
    uint corner = frame.scene.triangles.at[triangle][uint(gl_VertexIndex) % 3u];
    outPosition = frame.scene.positions.at[corner];
    outNormal = frame.scene.normals.at[corner];
    outTexcoord = frame.scene.texcoords.at[corner];
    outMaterial = frame.scene.triangleInfos.at[triangle].material;
    gl_Position = cameraClip(frame.camera, outPosition);
}
