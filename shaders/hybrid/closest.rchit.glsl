// The nearest triangle of a ray: reports which and where; the ray generation shader shades it.
#include "hybrid/hit.glsl"

layout(location = 0) rayPayloadInEXT Hit payload;
hitAttributeEXT vec2 barycentrics;

void main() {
    payload.triangle = uint(gl_InstanceCustomIndexEXT) + uint(gl_PrimitiveID);
    payload.barycentrics = barycentrics;
}
