// BENCH_BUILT_IN takes the number of the primitive from Vulkan: for structures that lvk did not build.
#include "bench/view.glsl"

layout(location = 0) rayPayloadInEXT Hit hit;

void main() {
#ifdef BENCH_BUILT_IN
    hit = Hit(gl_HitTEXT, uint(gl_PrimitiveID));
#else
    hit = Hit(gl_HitTEXT, uint(lvkPrimitiveIndex(tlas)));
#endif
}
