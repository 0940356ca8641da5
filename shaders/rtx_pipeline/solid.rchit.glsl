// Hit group kSolid.
#include "rtx_pipeline/recursion.glsl"

void main() {
    answer(shadeSolid(hitPoint(), gl_WorldRayDirectionEXT, payload.cone));
}
