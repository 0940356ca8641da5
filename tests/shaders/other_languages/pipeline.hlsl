// A ray tracing pipeline that writes a hit record for each ray, as ../closest.rgen.glsl, ../record.rmiss.glsl and
// ../record.rchit.glsl do. Each entry point becomes a module of its own: STAGE selects it.
#include "ray_records.hlsli"

struct HitRecord {
    uint4 halves[2];
};

#if STAGE == 0
[shader("raygeneration")]
void main() {
    uint2 launch = DispatchRaysIndex().xy;
    uint index = launch.y * DispatchRaysDimensions().x + launch.x;
    if (index >= push.count) return;
    float4 origin = vk::RawBufferLoad<float4>(push.rays + 32 * uint64_t(index));
    float4 direction = vk::RawBufferLoad<float4>(push.rays + 32 * uint64_t(index) + 16);
    RayDesc desc = { origin.xyz, origin.w, direction.xyz, direction.w };
    HitRecord record = (HitRecord)0;
    TraceRay(kTLAS[push.tlas], push.flags, push.mask, 0, 0, 0, desc, record);
    vk::RawBufferStore<uint4>(push.hits + 32 * uint64_t(index), record.halves[0]);
    vk::RawBufferStore<uint4>(push.hits + 32 * uint64_t(index) + 16, record.halves[1]);
}
#elif STAGE == 1
[shader("miss")]
void main(inout HitRecord record) { record = (HitRecord)0; }
#else
[shader("closesthit")]
void main(inout HitRecord record, in BuiltInTriangleIntersectionAttributes attributes) {
    uint instance = InstanceIndex();
    uint geometry = GeometryIndex();
    record.halves[0] = uint4(asuint(RayTCurrent()), asuint(attributes.barycentrics), HitKind());
    record.halves[1] = uint4(lvkMapInstance(push.tlas, instance), InstanceID(), geometry,
                             lvkMapPrimitive(push.tlas, instance, geometry, PrimitiveIndex()));
}
#endif
