// The six faces of the cube, unfolded, in a corner of the picture.
#include "omni_shadows/frame.glsl"

layout(location = 0) out vec2 place;
layout(location = 1) flat out uint side;

// Column and row of a face.
const vec2 kCells[6] = vec2[](vec2(2, 1), vec2(0, 1), vec2(1, 0), vec2(1, 2), vec2(1, 1), vec2(3, 1));

void main() {
    side = gl_InstanceIndex;
    place = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
    vec2 size = vec2(float(frame.camera.height) / float(frame.camera.width), 1.0) / 4.5;
    vec2 corner = vec2(1.0, 1.0) - size * vec2(4.15, 3.15);
    gl_Position = vec4(corner + size * (kCells[side] + 0.5 + 0.97 * (place - 0.5)), 0.0, 1.0);
}
