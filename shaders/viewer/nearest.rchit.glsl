// The nearest triangle of a ray: reports which and where; the ray generation shader shades it.
#include "viewer/hit.glsl"

layout(location = 0) rayPayloadInEXT Payload payload;
hitAttributeEXT vec2 barycentrics;

void main() {
    payload.hit.instance = uint(gl_InstanceCustomIndexEXT);
    payload.hit.geometry = uint(lvkGeometryIndex());
    payload.hit.primitive = uint(lvkPrimitiveIndex(frame.tlas));
    payload.hit.barycentrics = barycentrics;
    payload.hit.distance = gl_HitTEXT;
}
