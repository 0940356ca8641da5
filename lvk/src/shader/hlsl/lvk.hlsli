// The descriptors of lvk for HLSL (DXC) and Slang, by the names that GLSL has. The manual's page `shader_interface` has
// the rules and the compilers' options.
//
// The preamble of GLSL is not part of this file: push constants, buffers by address and entry points are declared as
// the language does. A test compares this file with the bindings of the library.
#ifndef LVK_HLSLI
#define LVK_HLSLI

// Textures of every kind share one binding, with the index of a texture handle.
[[vk::binding(0, 0)]] Texture2D<float4> kTextures2D[];
[[vk::binding(0, 0)]] Texture2DArray<float4> kTextures2DArray[];
[[vk::binding(0, 0)]] Texture3D<float4> kTextures3D[];
[[vk::binding(0, 0)]] TextureCube<float4> kTexturesCube[];
[[vk::binding(0, 0)]] Texture2D<uint4> kTexturesU2D[];
[[vk::binding(0, 0)]] Texture2D<int4> kTexturesI2D[];
[[vk::binding(0, 0)]] Texture2DMS<float4> kTextures2DMS[];

// Samplers, by the index of a sampler handle.
[[vk::binding(1, 0)]] SamplerState kSamplers[];
[[vk::binding(1, 0)]] SamplerComparisonState kSamplersShadow[];

// Storage images, by the index of a texture handle.
[[vk::binding(2, 0)]] [[vk::image_format("unknown")]] RWTexture2D<float4> kImages2D[];
[[vk::binding(2, 0)]] [[vk::image_format("unknown")]] RWTexture2DArray<float4> kImages2DArray[];
[[vk::binding(2, 0)]] [[vk::image_format("unknown")]] RWTexture3D<float4> kImages3D[];
[[vk::binding(2, 0)]] [[vk::image_format("unknown")]] RWTexture2D<uint4> kImagesU2D[];
[[vk::binding(2, 0)]] [[vk::image_format("unknown")]] RWTexture2D<int4> kImagesI2D[];

// Top-level acceleration structures, by the index of a TLAS handle.
[[vk::binding(4, 0)]] RaytracingAccelerationStructure kTLAS[];

// Textures and storage images of other kinds: LVK_TEXTURES(Texture3D<uint4>, kVolumes);
// LVK_STORAGE_IMAGES(RWTexture2D<uint>, "r32ui", kCounters);
#define LVK_TEXTURES(type, name) [[vk::binding(0, 0)]] type name[]
#define LVK_STORAGE_IMAGES(type, format, name) [[vk::binding(2, 0)]] [[vk::image_format(format)]] type name[]

// Input attachments of fragment shaders: LVK_INPUT(0, SubpassInput<float4>, color); then color.SubpassLoad().
#define LVK_INPUT_AT(place, type, name) [[vk::input_attachment_index(place)]] [[vk::binding(place, 1)]] type name
#define LVK_INPUT(target, type, name) LVK_INPUT_AT(1 + target, type, name)
#define LVK_DEPTH_INPUT(type, name) LVK_INPUT_AT(0, type, name)
#define LVK_STENCIL_INPUT(type, name) LVK_INPUT_AT(9, type, name)

// The helper without a level needs derivatives: it is for fragment shaders.
float4 textureBindless2D(uint tex, uint smp, float2 uv) {
    return kTextures2D[NonUniformResourceIndex(tex)].Sample(kSamplers[NonUniformResourceIndex(smp)], uv);
}
float4 textureBindless2DLod(uint tex, uint smp, float2 uv, float lod) {
    return kTextures2D[NonUniformResourceIndex(tex)].SampleLevel(kSamplers[NonUniformResourceIndex(smp)], uv, lod);
}
float4 textureBindless2DArrayLod(uint tex, uint smp, float3 uvLayer, float lod) {
    SamplerState by = kSamplers[NonUniformResourceIndex(smp)];
    return kTextures2DArray[NonUniformResourceIndex(tex)].SampleLevel(by, uvLayer, lod);
}
float4 textureBindless3DLod(uint tex, uint smp, float3 uvw, float lod) {
    return kTextures3D[NonUniformResourceIndex(tex)].SampleLevel(kSamplers[NonUniformResourceIndex(smp)], uvw, lod);
}
float4 textureBindlessCubeLod(uint tex, uint smp, float3 dir, float lod) {
    return kTexturesCube[NonUniformResourceIndex(tex)].SampleLevel(kSamplers[NonUniformResourceIndex(smp)], dir, lod);
}
float4 textureBindlessFetch2D(uint tex, int2 texel, int lod) {
    return kTextures2D[NonUniformResourceIndex(tex)].Load(int3(texel, lod));
}

// The ids of a hit in kTLAS[tlas], as the application counts instances and primitives. Vulkan counts the parts of split
// and reordered meshes; a hit remap table maps its ids.
struct LvkTlasEntry {
    uint2 rows;     // address of the hit remap table; 0 without one
    uint2 software; // the library's own
};
[[vk::binding(5, 0)]] StructuredBuffer<LvkTlasEntry> kLvkTlasTable;

#ifdef __SLANG__
uint lvkLoadWord(uint2 address, uint word) { return bit_cast<uint*>(address)[word]; }
#else
uint lvkLoadWord(uint2 address, uint word) {
    return vk::RawBufferLoad<uint>((uint64_t(address.y) << 32 | address.x) + 4 * uint64_t(word));
}
#endif

uint lvkMapInstance(uint tlas, uint instance) {
    uint2 rows = kLvkTlasTable[tlas].rows;
    return all(rows == 0) ? instance : lvkLoadWord(rows, instance * 4 + 2);
}

uint lvkMapPrimitive(uint tlas, uint instance, uint geometry, uint primitive) {
    uint2 rows = kLvkTlasTable[tlas].rows;
    if (all(rows == 0)) return primitive;
    uint2 map = uint2(lvkLoadWord(rows, instance * 4), lvkLoadWord(rows, instance * 4 + 1));
    if (all(map == 0)) return primitive;
    return lvkLoadWord(map, lvkLoadWord(map, geometry) + primitive);
}

#endif
