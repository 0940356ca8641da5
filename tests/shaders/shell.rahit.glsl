// Ignores the near side of spheres that are not opaque.
void main() {
    if (gl_HitKindEXT >= 126u) {
        ignoreIntersectionEXT;
    }
}
