// Reports a vertex of the hit triangle by ray query.
#include "ray_query_start.glsl"

void main() {
    START_RAY_QUERY;
    vec3 corners[3];
    while (lvkRayQueryProceed(rq)) {
        lvkRayQueryTriangleVertexPositions(rq, LVK_CANDIDATE, corners);
        if (corners[0].x + corners[1].x + corners[2].x >= 0.0) {
            lvkRayQueryConfirmIntersection(rq);
        }
    }
    HitRecord record = kNoHit;
    if (lvkRayQueryType(rq, LVK_COMMITTED) == LVK_COMMITTED_TRIANGLE) {
        lvkRayQueryTriangleVertexPositions(rq, LVK_COMMITTED, corners);
        record = HitRecord(corners[CORNER].x, corners[CORNER].yz, lvkRayQueryFrontFace(rq, LVK_COMMITTED) ? kFront : kBack,
                           lvkRayQueryInstanceId(rq, LVK_COMMITTED, tlas),
                           lvkRayQueryInstanceCustomIndex(rq, LVK_COMMITTED),
                           lvkRayQueryGeometryIndex(rq, LVK_COMMITTED),
                           lvkRayQueryPrimitiveIndex(rq, LVK_COMMITTED, tlas));
    }
    hits.at[index] = record;
}
