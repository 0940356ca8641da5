// Corners of the draws that the sun sees, by number.
#include "sponza/frame.glsl"

layout(location = 0) out vec2 outTexcoord;
layout(location = 1) flat out uint outMaterial;

void main() {
    uint vertex = vertexAt(uint(gl_VertexIndex));
    outTexcoord = frame.scene.texcoords.at[vertex];
    outMaterial = materialAt(uint(gl_VertexIndex));
    gl_Position = vec4(sunClip(frame.scene.positions.at[vertex]), 1.0);
}
