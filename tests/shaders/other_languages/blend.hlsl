// Stores a texture multiplied by colours from a buffer, as blend.comp.glsl does.
#include <lvk.hlsli>

struct Push {
    uint64_t colors;
    uint tex;
    uint smp;
    uint image;
    uint2 size;
};
[[vk::push_constant]] Push push;

[numthreads(8, 8, 1)]
void main(uint3 id : SV_DispatchThreadID) {
    if (any(id.xy >= push.size)) return;
    float2 uv = (float2(id.xy) + 0.5) / float2(push.size);
    float4 color = vk::RawBufferLoad<float4>(push.colors + 16 * uint64_t(id.x), 16);
    kImages2D[push.image][id.xy] = textureBindless2DLod(push.tex, push.smp, uv, 0.0) * color;
}
