// Spheres by ray query. The instance's hit group offset, which queries do not use otherwise, chooses the radius.
#include "ray_query_start.glsl"
#include "sphere_object.glsl"

const float kRadius[2] = float[](0.9, 0.5);
const uint kTag[2] = uint[](17, 99);

void main() {
    START_RAY_QUERY;
    float end = ray.tMax;
    while (lvkRayQueryProceed(rq)) {
        if (lvkRayQueryType(rq, LVK_CANDIDATE) != LVK_CANDIDATE_AABB) {
            continue;
        }
        vec2 places;
        vec3 center = sphereCenter(lvkRayQueryGeometryIndex(rq, LVK_CANDIDATE),
                                   lvkRayQueryPrimitiveIndex(rq, LVK_CANDIDATE, tlas));
        vec3 origin = lvkRayQueryObjectRayOrigin(rq, LVK_CANDIDATE);
        vec3 direction = lvkRayQueryObjectRayDirection(rq, LVK_CANDIDATE);
        float radius = kRadius[lvkRayQueryInstanceShaderBindingTableRecordOffset(rq, LVK_CANDIDATE)];
        if (crossSphere(center, radius, origin, direction, places)) {
            float place = places.x >= ray.tMin ? places.x : places.y;
            if (place >= ray.tMin && place <= end) {
                lvkRayQueryGenerateIntersection(rq, place);
                end = place;
            }
        }
    }
    HitRecord record = kNoHit;
    if (lvkRayQueryType(rq, LVK_COMMITTED) == LVK_COMMITTED_GENERATED) {
        uint group = lvkRayQueryInstanceShaderBindingTableRecordOffset(rq, LVK_COMMITTED);
        record = HitRecord(lvkRayQueryT(rq, LVK_COMMITTED), vec2(kRadius[group], float(kTag[group])), kTag[group],
                           lvkRayQueryInstanceId(rq, LVK_COMMITTED, tlas),
                           lvkRayQueryInstanceCustomIndex(rq, LVK_COMMITTED),
                           lvkRayQueryGeometryIndex(rq, LVK_COMMITTED),
                           lvkRayQueryPrimitiveIndex(rq, LVK_COMMITTED, tlas));
    }
    hits.at[index] = record;
}
