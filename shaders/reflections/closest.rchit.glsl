// The nearest triangle of a ray: reports which and where; the ray generation shader shades it.
#include "reflections/surface.glsl"

layout(location = 0) rayPayloadInEXT Hit payload;
hitAttributeEXT vec2 barycentrics;

void main() {
    payload.instance = uint(gl_InstanceCustomIndexEXT);
    payload.geometry = uint(lvkGeometryIndex());
    payload.primitive = uint(lvkPrimitiveIndex(frame.tlas));
    payload.barycentrics = barycentrics;
    payload.distance = gl_HitTEXT;
}
