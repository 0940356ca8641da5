// A ray that left the scene, or ended.
#include "reflections/surface.glsl"

layout(location = 0) rayPayloadInEXT Hit payload;

void main() {
    payload.instance = kNothing;
}
