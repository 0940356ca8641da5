// Which boxes a ray meets: a bit for each of up to 32, as the number of the primitive.
#include <lvk/ray_query.glsl>
#include "ray_records.glsl"

layout(local_size_x = 64) in;

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= count) {
        return;
    }
    Ray ray = rays.at[index];
    LvkRayQuery rq;
    lvkRayQueryInitialize(rq, tlas, flags, mask, ray.origin, ray.tMin, ray.direction, ray.tMax);
    HitRecord record = kNoHit;
    while (lvkRayQueryProceed(rq)) {
        record.primitive |= 1u << lvkRayQueryPrimitiveIndex(rq, LVK_CANDIDATE, tlas);
    }
    hits.at[index] = record;
}
