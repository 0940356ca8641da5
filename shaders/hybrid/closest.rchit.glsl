// The nearest triangle of a ray: reports which and where; the ray generation shader shades it.
#include "hybrid/frame.glsl"
#include "hybrid/hit.glsl"

layout(location = 0) rayPayloadInEXT Hit payload;
hitAttributeEXT vec2 barycentrics;

void main() {
    payload.triangle = uint(gl_InstanceCustomIndexEXT) + uint(lvkPrimitiveIndex(frame.tlas));
    payload.barycentrics = barycentrics;
}
