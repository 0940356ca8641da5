// Hit group kGlass.
#include "rtx_pipeline/recursion.glsl"

void main() {
    answer(shadeGlass(hitPoint(), gl_WorldRayDirectionEXT, payload.cone));
}
