// Corners of the drop's grid.
#include "render_to_cube_map/drop.glsl"
layout(location = 0) out vec3 direction;

void main() {
    uint quad = gl_VertexIndex / 6;
    uint corner = uint[](0u, 1u, 2u, 2u, 1u, 3u)[gl_VertexIndex % 6];
    vec2 at = vec2(quad % kGrid.x + (corner & 1u), quad / kGrid.x + (corner >> 1)) / vec2(kGrid);
    float around = 6.2831853 * at.x;
    float down = 3.1415927 * at.y;
    direction = vec3(sin(down) * cos(around), cos(down), sin(down) * sin(around));
    gl_Position = cameraClip(frame.cameras[view], kDrop + dropRadius(direction) * direction);
}
