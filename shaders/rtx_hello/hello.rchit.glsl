// The nearest triangle of a ray.
#include "rtx_hello/view.glsl"
layout(location = 0) rayPayloadInEXT vec3 color;
hitAttributeEXT vec2 barycentrics;

void main() {
    color = triangleColor(barycentrics, gl_ObjectToWorldEXT[2]);
}
