// A quad that shows a leaf: rays pass where its texture is empty.
#include "reflections/surface.glsl"

hitAttributeEXT vec2 barycentrics;

void main() {
    uint primitive = uint(lvkPrimitiveIndex(frame.tlas));
    if (!isSolid(uint(gl_InstanceCustomIndexEXT), uint(lvkGeometryIndex()), primitive, barycentrics)) {
        ignoreIntersectionEXT;
    }
}
