// Corners of the user interface's triangles.
#include "app/ui.glsl"
layout(location = 0) out vec2 uv;
layout(location = 1) out vec4 color;

void main() {
    UiVertex corner = vertices.at[gl_VertexIndex];
    uv = corner.uv;
    color = unpackUnorm4x8(corner.color);
    gl_Position = vec4(corner.position * clipPerPoint - 1.0, 0.0, 1.0);
}
