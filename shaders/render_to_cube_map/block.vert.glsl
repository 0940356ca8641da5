// Corners of the blocks around: 36 of each, an instance for each block.
#include "render_to_cube_map/view.glsl"
layout(location = 0) out vec3 position;
layout(location = 1) flat out vec3 normal;
layout(location = 2) flat out uint number;

void main() {
    Block block = frame.blocks.at[gl_InstanceIndex];
    uint side = gl_VertexIndex / 6;
    uint corner = uint[](0u, 1u, 2u, 2u, 1u, 3u)[gl_VertexIndex % 6];
    vec3 axis = vec3(equal(uvec3(side >> 1), uvec3(0u, 1u, 2u)));
    vec3 outwards = (side & 1u) == 0u ? axis : -axis;
    vec2 across = vec2(corner & 1u, corner >> 1) * 2.0 - 1.0;
    vec3 place = outwards - across.x * outwards.yzx + across.y * axis.zxy; // counter-clockwise from outside
    mat3 turned = mat3(cos(block.turn), 0.0, -sin(block.turn), 0.0, 1.0, 0.0, sin(block.turn), 0.0, cos(block.turn));
    position = block.middle + turned * (place * block.halfSize);
    normal = turned * outwards;
    number = gl_InstanceIndex;
    gl_Position = cameraClip(viewCamera(), position);
}
