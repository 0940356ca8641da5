// The same by ray query.
#include <lvk/ray_query.glsl>
#include "ray_records.glsl"

layout(local_size_x = 64) in;

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= count) {
        return;
    }
    Ray ray = rays.at[index];
    vec3 corners[3];
    LvkRayQuery rq;
    lvkRayQueryInitialize(rq, tlas, flags, mask, ray.origin, ray.tMin, ray.direction, ray.tMax);
    while (lvkRayQueryProceed(rq)) {
        lvkRayQueryTrianglePositions(rq, LVK_CANDIDATE, corners);
        if (corners[0].x + corners[1].x + corners[2].x >= 0.0) {
            lvkRayQueryConfirmIntersection(rq);
        }
    }
    HitRecord record = kNoHit;
    if (lvkRayQueryType(rq, LVK_COMMITTED) == LVK_COMMITTED_TRIANGLE) {
        lvkRayQueryTrianglePositions(rq, LVK_COMMITTED, corners);
        record = HitRecord(corners[CORNER].x, corners[CORNER].yz, lvkRayQueryFrontFace(rq, LVK_COMMITTED) ? kFront : kBack,
                           lvkRayQueryInstanceId(rq, LVK_COMMITTED, tlas),
                           lvkRayQueryInstanceCustomIndex(rq, LVK_COMMITTED),
                           lvkRayQueryGeometryIndex(rq, LVK_COMMITTED),
                           lvkRayQueryPrimitiveIndex(rq, LVK_COMMITTED, tlas));
    }
    hits.at[index] = record;
}
