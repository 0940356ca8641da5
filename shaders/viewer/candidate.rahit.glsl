// A triangle that a ray may go through.
#include "viewer/candidate.glsl"

layout(location = 0) rayPayloadInEXT Payload payload;
hitAttributeEXT vec2 barycentrics;

void main() {
    Hit hit;
    hit.instance = uint(gl_InstanceCustomIndexEXT);
    hit.geometry = uint(lvkGeometryIndex());
    hit.primitive = uint(lvkPrimitiveIndex(frame.tlas));
    hit.barycentrics = barycentrics;
    hit.distance = gl_HitTEXT;
    if (passesThrough(hit, gl_WorldRayDirectionEXT, payload)) {
        ignoreIntersectionEXT;
    }
}
