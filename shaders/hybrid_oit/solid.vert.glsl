// Floor and blocks. The depth pass and the G-buffer pass share it, and `invariant` gives them the same depths.
#include "hybrid_oit/frame.glsl"

invariant gl_Position;
layout(location = 0) out vec3 outPosition;
layout(location = 1) flat out uint outFace;

void main() {
    outPosition = frame.positions.at[gl_VertexIndex];
    outFace = uint(gl_VertexIndex) / 6u;
    gl_Position = cameraClip(frame.camera, outPosition);
}
