// The moving picture, as large as it fits.
#include "yuv/push.glsl"

layout(location = 0) out vec2 place;

void main() {
    place = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
    gl_Position = vec4((2.0 * place - 1.0) * covered, 0.0, 1.0);
}
