// Writes a hit record for each ray, as ../query.comp.glsl does.
#include "ray_records.hlsli"

[numthreads(64, 1, 1)]
void main(uint3 id : SV_DispatchThreadID) {
    if (id.x >= push.count) return;
    float4 origin = vk::RawBufferLoad<float4>(push.rays + 32 * uint64_t(id.x));
    float4 direction = vk::RawBufferLoad<float4>(push.rays + 32 * uint64_t(id.x) + 16);
    RayDesc desc = { origin.xyz, origin.w, direction.xyz, direction.w };
    RayQuery<RAY_FLAG_NONE> rq;
    rq.TraceRayInline(kTLAS[push.tlas], push.flags, push.mask, desc);
    while (rq.Proceed()) {
        if (rq.CandidateType() == CANDIDATE_NON_OPAQUE_TRIANGLE) rq.CommitNonOpaqueTriangleHit();
    }
    uint4 record[2] = { (uint4)0, (uint4)0 };
    if (rq.CommittedStatus() == COMMITTED_TRIANGLE_HIT) {
        uint instance = rq.CommittedInstanceIndex();
        uint geometry = rq.CommittedGeometryIndex();
        uint kind = rq.CommittedTriangleFrontFace() ? 0xfe : 0xff;
        record[0] = uint4(asuint(rq.CommittedRayT()), asuint(rq.CommittedTriangleBarycentrics()), kind);
        record[1] = uint4(lvkMapInstance(push.tlas, instance), rq.CommittedInstanceID(), geometry,
                          lvkMapPrimitive(push.tlas, instance, geometry, rq.CommittedPrimitiveIndex()));
    }
    vk::RawBufferStore<uint4>(push.hits + 32 * uint64_t(id.x), record[0]);
    vk::RawBufferStore<uint4>(push.hits + 32 * uint64_t(id.x) + 16, record[1]);
}
