// Corners of the draws that the sun sees, by number.
#include "sponza/frame.glsl"

layout(location = 0) out vec2 outTexcoord;
layout(location = 1) flat out uint outMaterial;

void main() {
    uint triangle = uint(gl_VertexIndex) / 3u;
    uint corner = frame.scene.triangles.at[triangle][uint(gl_VertexIndex) % 3u];
    outTexcoord = frame.scene.texcoords.at[corner];
    outMaterial = frame.scene.triangleInfos.at[triangle].material;
    gl_Position = vec4(sunClip(frame.scene.positions.at[corner]), 1.0);
}
