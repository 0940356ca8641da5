// The corners of a triangle that turns, each with its colour.
layout(push_constant) uniform Push { float turn; float aspect; };
layout(location = 0) out vec3 color;

const vec3 kColors[3] = vec3[](vec3(0.9, 0.02, 0.08), vec3(0.0, 0.62, 0.2), vec3(0.03, 0.12, 1.0));

void main() {
    float angle = radians(360.0) * (turn + float(gl_VertexIndex) / 3.0);
    gl_Position = vec4(0.85 * sin(angle) / aspect, -0.85 * cos(angle), 0.0, 1.0);
    color = kColors[gl_VertexIndex];
}
