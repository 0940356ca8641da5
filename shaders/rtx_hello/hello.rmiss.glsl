// A ray that met nothing.
#include "rtx_hello/view.glsl"
layout(location = 0) rayPayloadInEXT vec3 color;

void main() {
    color = backdropColor(gl_WorldRayDirectionEXT);
}
