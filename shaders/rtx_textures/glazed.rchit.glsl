// Hit group kGlazed.
#include "rtx_textures/hit.glsl"

void main() {
    payload = asGlazed(hitSurface());
}
