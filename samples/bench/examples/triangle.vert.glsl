#version 460
layout(location = 0) out vec3 shade;
void main() {
    const vec2 corners[3] = { vec2(0.0, -0.8), vec2(0.8, 0.8), vec2(-0.8, 0.8) };
    gl_Position = vec4(corners[gl_VertexIndex], 0, 1);
    shade = vec3(equal(ivec3(gl_VertexIndex), ivec3(0, 1, 2)));
}
