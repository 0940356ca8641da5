// The counts of candidates by ray query. With FUNCTION, the traversal calls the function that judges them.
#ifdef FUNCTION
#define LVK_TRIANGLES_ONLY
#define LVK_CANDIDATE_FUNCTION judge
#endif
#include "ray_query_start.glsl"
#include "any_hit_payload.glsl"

Seen seen = Seen(kNoHit, 0, 0);

void judge(LvkRayQueryParameter rq) {
    seen.count += 1;
    seen.sum += tagOf(lvkRayQueryInstanceId(rq, LVK_CANDIDATE, tlas), lvkRayQueryGeometryIndex(rq, LVK_CANDIDATE),
                      lvkRayQueryPrimitiveIndex(rq, LVK_CANDIDATE, tlas));
#if !defined(IGNORE)
    lvkRayQueryConfirmIntersection(rq);
#endif
#if defined(TERMINATE)
    lvkRayQueryTerminate(rq);
#endif
}

void main() {
    START_RAY_QUERY;
    while (lvkRayQueryProceed(rq)) {
        judge(rq);
    }
    if (lvkRayQueryType(rq, LVK_COMMITTED) == LVK_COMMITTED_TRIANGLE) {
        seen.record.t = lvkRayQueryT(rq, LVK_COMMITTED);
        seen.record.kind = lvkRayQueryFrontFace(rq, LVK_COMMITTED) ? kFront : kBack;
        seen.record.instance = lvkRayQueryInstanceId(rq, LVK_COMMITTED, tlas);
        seen.record.customIndex = lvkRayQueryInstanceCustomIndex(rq, LVK_COMMITTED);
        seen.record.geometry = lvkRayQueryGeometryIndex(rq, LVK_COMMITTED);
        seen.record.primitive = lvkRayQueryPrimitiveIndex(rq, LVK_COMMITTED, tlas);
    }
    seen.record.barycentrics = vec2(seen.count, seen.sum);
    hits.at[index] = seen.record;
}
