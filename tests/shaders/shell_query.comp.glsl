// Both sides of spheres by ray query. Queries have no kinds and no attributes of AABBs, so the shader stores them. Triangles
// count too.
#include <lvk/ray_query.glsl>
#ifdef PRIMITIVE_CULLING
#extension GL_EXT_ray_flags_primitive_culling : require
layout(primitive_culling);
#endif
#include "ray_query_start.glsl"
#include "sphere_object.glsl"

void main() {
    START_RAY_QUERY;
    float end = ray.tMax;
    HitRecord record = kNoHit;
    while (lvkRayQueryProceed(rq)) {
        if (lvkRayQueryType(rq, LVK_CANDIDATE) == LVK_CANDIDATE_TRIANGLE) {
            lvkRayQueryConfirmIntersection(rq);
            end = lvkRayQueryT(rq, LVK_COMMITTED);
            continue;
        }
        vec2 places;
        vec3 center = sphereCenter(lvkRayQueryGeometryIndex(rq, LVK_CANDIDATE),
                                   lvkRayQueryPrimitiveIndex(rq, LVK_CANDIDATE, tlas));
        if (!crossSphere(center, RADIUS, lvkRayQueryObjectRayOrigin(rq, LVK_CANDIDATE),
                         lvkRayQueryObjectRayDirection(rq, LVK_CANDIDATE), places)) {
            continue;
        }
        if (lvkRayQueryType(rq, LVK_COMMITTED) != LVK_COMMITTED_NONE) {
            end = lvkRayQueryT(rq, LVK_COMMITTED);
        }
        bool far = places.y >= ray.tMin && places.y <= end;
        if (far) {
            lvkRayQueryGenerateIntersection(rq, places.y);
            record.kind = 2;
            end = places.y;
        }
        if (lvkRayQueryCandidateAABBOpaque(rq) && places.x >= ray.tMin && places.x <= end) {
            lvkRayQueryGenerateIntersection(rq, places.x);
            record.kind = far ? 127 : 126;
        }
    }
    uint type = lvkRayQueryType(rq, LVK_COMMITTED);
    if (type == LVK_COMMITTED_NONE) {
        record = kNoHit;
    } else {
        if (type == LVK_COMMITTED_TRIANGLE) {
            record.kind = lvkRayQueryFrontFace(rq, LVK_COMMITTED) ? kFront : kBack;
            record.barycentrics = lvkRayQueryBarycentrics(rq, LVK_COMMITTED);
        }
        record.t = lvkRayQueryT(rq, LVK_COMMITTED);
        record.instance = lvkRayQueryInstanceId(rq, LVK_COMMITTED, tlas);
        record.customIndex = lvkRayQueryInstanceCustomIndex(rq, LVK_COMMITTED);
        record.geometry = lvkRayQueryGeometryIndex(rq, LVK_COMMITTED);
        record.primitive = lvkRayQueryPrimitiveIndex(rq, LVK_COMMITTED, tlas);
        if (type == LVK_COMMITTED_GENERATED) {
            record.barycentrics = vec2(record.primitive, record.instance);
        }
    }
    hits.at[index] = record;
}
