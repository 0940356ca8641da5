// Looks through every second primitive.
void main() {
    if ((gl_PrimitiveID & 1) != 0) {
        ignoreIntersectionEXT;
    }
}
