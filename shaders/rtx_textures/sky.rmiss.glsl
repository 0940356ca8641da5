// A ray that left the scene.
#include "rtx_textures/surface.glsl"

layout(location = 0) rayPayloadInEXT Found payload;

void main() {
    payload.distance = -1.0;
}
