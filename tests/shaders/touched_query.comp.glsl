// Candidates of a ray: a bit for each of up to 32 AABBs, as the primitive number.
#include "ray_query_start.glsl"

void main() {
    START_RAY_QUERY;
    HitRecord record = kNoHit;
    while (lvkRayQueryProceed(rq)) {
        record.primitive |= 1u << lvkRayQueryPrimitiveIndex(rq, LVK_CANDIDATE, tlas);
    }
    hits.at[index] = record;
}
