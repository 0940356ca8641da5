// Hit records by ray query. KEEP_EVEN ignores every second primitive.
#include "ray_query_start.glsl"

void main() {
    START_RAY_QUERY;
    while (lvkRayQueryProceed(rq)) {
        if (lvkRayQueryType(rq, LVK_CANDIDATE) != LVK_CANDIDATE_TRIANGLE) {
            continue;
        }
#ifdef KEEP_EVEN
        if ((lvkRayQueryPrimitiveIndex(rq, LVK_CANDIDATE, tlas) & 1) != 0) {
            continue;
        }
#endif
        lvkRayQueryConfirmIntersection(rq);
    }
    HitRecord record = kNoHit;
    if (lvkRayQueryType(rq, LVK_COMMITTED) == LVK_COMMITTED_TRIANGLE) {
        record.t = lvkRayQueryT(rq, LVK_COMMITTED);
        record.barycentrics = lvkRayQueryBarycentrics(rq, LVK_COMMITTED);
        record.kind = lvkRayQueryFrontFace(rq, LVK_COMMITTED) ? kFront : kBack;
        record.instance = lvkRayQueryInstanceId(rq, LVK_COMMITTED, tlas);
        record.customIndex = lvkRayQueryInstanceCustomIndex(rq, LVK_COMMITTED);
        record.geometry = lvkRayQueryGeometryIndex(rq, LVK_COMMITTED);
        record.primitive = lvkRayQueryPrimitiveIndex(rq, LVK_COMMITTED, tlas);
    }
    hits.at[index] = record;
}
