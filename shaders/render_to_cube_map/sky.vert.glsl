// A triangle over everything, infinitely far away.
#include "render_to_cube_map/view.glsl"
layout(location = 0) out vec3 direction;

void main() {
    vec2 place = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0;
    Camera camera = viewCamera();
    direction = camera.forward + place.x * camera.right + place.y * camera.down;
    gl_Position = vec4(place, 0.0, 1.0);
}
