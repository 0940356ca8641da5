// Uses every name of lvk.hlsli, in a fragment shader. DXC and Slang both compile it.
#include <lvk.hlsli>

LVK_TEXTURES(Texture3D<uint4>, kVolumes);
LVK_STORAGE_IMAGES(RWTexture2D<float4>, "rgba8", kRgba8);
LVK_INPUT(2, SubpassInput<float4>, color);
LVK_DEPTH_INPUT(SubpassInput<float4>, depth);
LVK_STENCIL_INPUT(SubpassInput<uint4>, stencil);

struct Push {
    uint tex;
    uint smp;
    float2 uv;
};
[[vk::push_constant]] Push push;

float4 main() : SV_Target0 {
    uint tex = push.tex;
    uint smp = push.smp;
    float3 uvw = float3(push.uv, 0.5);
    float4 sum = textureBindless2D(tex, smp, push.uv) + textureBindless2DLod(tex, smp, push.uv, 1.0);
    sum += textureBindless2DArrayLod(tex, smp, uvw, 1.0) + textureBindless3DLod(tex, smp, uvw, 1.0);
    sum += textureBindlessCubeLod(tex, smp, uvw, 1.0) + textureBindlessFetch2D(tex, int2(1, 2), 0);
    sum += float4(kTexturesU2D[tex].Load(int3(0, 0, 0))) + float4(kTexturesI2D[tex].Load(int3(0, 0, 0)));
    sum += kTextures2DMS[tex].Load(int2(0, 0), 1) + float4(kVolumes[tex].Load(int4(0, 0, 0, 0)));
    sum += kTextures2D[tex].SampleCmpLevelZero(kSamplersShadow[smp], push.uv, 0.5);
    sum += kTextures2DArray[tex].Load(int4(0, 0, 0, 0)) + kTextures3D[tex].Load(int4(0, 0, 0, 0));
    sum += kTexturesCube[tex].SampleLevel(kSamplers[smp], uvw, 0.0);
    sum += color.SubpassLoad() + depth.SubpassLoad() + float4(stencil.SubpassLoad());
    sum += float4(lvkMapInstance(tex, 1), lvkMapPrimitive(tex, 1, 2, 3), 0.0, 0.0);
    RayDesc ray = { uvw, 0.0, float3(0.0, 0.0, 1.0), 9.0 };
    RayQuery<RAY_FLAG_FORCE_OPAQUE> rq;
    rq.TraceRayInline(kTLAS[tex], RAY_FLAG_NONE, 0xff, ray);
    rq.Proceed();
    kImages2D[tex][uint2(0, 0)] = sum;
    kImages2DArray[tex][uint3(0, 0, 0)] = sum;
    kImages3D[tex][uint3(0, 0, 0)] = sum;
    kImagesU2D[tex][uint2(0, 0)] = uint4(1, 2, 3, 4);
    kImagesI2D[tex][uint2(0, 0)] = int4(1, 2, 3, 4);
    kRgba8[tex][uint2(0, 0)] = kRgba8[tex][uint2(1, 1)];
    return sum * rq.CommittedRayT();
}
