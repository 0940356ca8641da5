// A ray that left the world.
#include "large_scene/hit.glsl"

layout(location = 0) rayPayloadInEXT Hit nearest;

void main() {
    nearest.triangle = kNothing;
}
