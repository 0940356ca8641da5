// A ray that left the scene.
#include "hybrid/hit.glsl"

layout(location = 0) rayPayloadInEXT Hit payload;

void main() {
    payload.triangle = kNoTriangle;
}
