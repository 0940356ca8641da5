// Y, Cb and Cr at the left, one below the other.
#include "yuv/push.glsl"

layout(location = 0) out vec2 place;
layout(location = 1) flat out uint which;

void main() {
    which = gl_InstanceIndex;
    place = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
    vec2 size = 0.28 * covered * 2.0;
    vec2 corner = -covered + 0.04 + vec2(0.0, float(which) * (size.y + 0.04));
    gl_Position = vec4(corner + size * place, 0.0, 1.0);
}
