// A shadow ray that nothing opaque stopped.
#include "hybrid_oit/payload.glsl"

layout(location = 0) rayPayloadInEXT Sunlight payload;

void main() {
    payload.isBlocked = 0u;
}
