// SBT_OFFSET, SBT_STRIDE and MISS_INDEX choose other shaders than the first ones.
#include "ray_records.glsl"

#ifndef SBT_OFFSET
#define SBT_OFFSET 0
#endif
#ifndef SBT_STRIDE
#define SBT_STRIDE 0
#endif
#ifndef MISS_INDEX
#define MISS_INDEX 0
#endif

layout(location = 0) rayPayloadEXT HitRecord record;

void main() {
    START_RAY_GEN;
    record = kNoHit;
    traceRayEXT(kTLAS[tlas], flags, mask, SBT_OFFSET, SBT_STRIDE, MISS_INDEX, ray.origin, ray.tMin, ray.direction,
                ray.tMax, 0);
    hits.at[index] = record;
}
