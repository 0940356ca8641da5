// Hit group kPainted.
#include "rtx_textures/hit.glsl"

void main() {
    payload = asPainted(hitSurface());
}
