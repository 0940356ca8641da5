// A ray that left the scene, or reached its light.
#include "viewer/hit.glsl"

layout(location = 0) rayPayloadInEXT Payload payload;

void main() {
    payload.hit.instance = kNothing;
}
