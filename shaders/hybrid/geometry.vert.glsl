// Geometry pass: every triangle of the scene in one draw, positions by index.
#include "hybrid/frame.glsl"

void main() {
    gl_Position = cameraClip(frame.camera, frame.scene.positions.at[gl_VertexIndex]);
}
