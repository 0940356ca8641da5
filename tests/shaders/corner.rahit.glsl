// Ignores triangles whose middle is at a negative x.
void main() {
    vec3 xs = vec3(gl_HitTriangleVertexPositionsEXT[0].x, gl_HitTriangleVertexPositionsEXT[1].x,
                   gl_HitTriangleVertexPositionsEXT[2].x);
    if (xs.x + xs.y + xs.z < 0.0) {
        ignoreIntersectionEXT;
    }
}
