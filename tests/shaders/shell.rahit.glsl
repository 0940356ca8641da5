// Looks through the near side of what is not opaque.
void main() {
    if (gl_HitKindEXT >= 126u) {
        ignoreIntersectionEXT;
    }
}
