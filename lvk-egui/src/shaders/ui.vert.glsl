// Vertices of an interface.
#include "push.glsl"
layout(location = 0) out vec2 uv;
layout(location = 1) out vec4 color;

void main() {
    UiVertex vertex = vertices.at[gl_VertexIndex];
    uv = vertex.uv;
    color = unpackUnorm4x8(vertex.color);
    gl_Position = vec4(vertex.position * clipPerPoint - 1.0, 0.0, 1.0);
}
