// One triangle that covers the picture, infinitely far away.
layout(location = 0) out vec2 outPlace;

void main() {
    outPlace = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0;
    gl_Position = vec4(outPlace, 0.0, 1.0);
}
