// Ignores every second primitive.
#include "ray_records.glsl"
void main() {
    if ((lvkPrimitiveIndex(tlas) & 1) != 0) {
        ignoreIntersectionEXT;
    }
}
