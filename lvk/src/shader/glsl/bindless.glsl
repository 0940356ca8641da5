layout(set = LVK_SET, binding = LVK_BINDING_SAMPLED_IMAGES) uniform texture2D kTextures2D[];
layout(set = LVK_SET, binding = LVK_BINDING_SAMPLED_IMAGES) uniform texture2DArray kTextures2DArray[];
layout(set = LVK_SET, binding = LVK_BINDING_SAMPLED_IMAGES) uniform texture3D kTextures3D[];
layout(set = LVK_SET, binding = LVK_BINDING_SAMPLED_IMAGES) uniform textureCube kTexturesCube[];
layout(set = LVK_SET, binding = LVK_BINDING_SAMPLED_IMAGES) uniform utexture2D kTexturesU2D[];
layout(set = LVK_SET, binding = LVK_BINDING_SAMPLED_IMAGES) uniform itexture2D kTexturesI2D[];
layout(set = LVK_SET, binding = LVK_BINDING_SAMPLED_IMAGES) uniform texture2DMS kTextures2DMS[];
#define kTextures2DShadow kTextures2D

// Textures of another shape. The shader declares them itself, because they may need a feature of the device. `type` is
// textureCubeArray, utexture3D and so on.
#define LVK_TEXTURES(type, name) layout(set = LVK_SET, binding = LVK_BINDING_SAMPLED_IMAGES) uniform type name[]

// Y'CbCr textures with their conversions, declared by the shader itself. The index must be a constant; a specialisation
// constant is allowed.
#define LVK_YUV_TEXTURES(name) layout(set = LVK_SET, binding = LVK_BINDING_YCBCR) uniform sampler2D name[]
#define textureBindlessYUV(name, index, uv) textureLod(name[index], uv, 0.0)

// Input attachments: the pass's attachments for its own fragment shaders, read at the fragment's pixel by subpassLoad.
// Colour attachments go by index. `type` is subpassInput, usubpassInput, isubpassInput, or one of these with MS.
#define LVK_INPUT_AT(place, type, name) \
    layout(input_attachment_index = place, set = LVK_INPUT_SET, binding = place) uniform type name
#define LVK_INPUT(target, type, name) LVK_INPUT_AT(LVK_PLACE_OF_COLOR + target, type, name)
#define LVK_DEPTH_INPUT(type, name) LVK_INPUT_AT(LVK_PLACE_OF_DEPTH, type, name)
#define LVK_STENCIL_INPUT(type, name) LVK_INPUT_AT(LVK_PLACE_OF_STENCIL, type, name)

layout(set = LVK_SET, binding = LVK_BINDING_SAMPLERS) uniform sampler kSamplers[];
layout(set = LVK_SET, binding = LVK_BINDING_SAMPLERS) uniform samplerShadow kSamplersShadow[];

#ifdef LVK_FORMATLESS_READ
#define LVK_IMAGE_ACCESS
#else
#define LVK_IMAGE_ACCESS writeonly
#endif
layout(set = LVK_SET, binding = LVK_BINDING_STORAGE_IMAGES) uniform LVK_IMAGE_ACCESS image2D kImages2D[];
layout(set = LVK_SET, binding = LVK_BINDING_STORAGE_IMAGES) uniform LVK_IMAGE_ACCESS image2DArray kImages2DArray[];
layout(set = LVK_SET, binding = LVK_BINDING_STORAGE_IMAGES) uniform LVK_IMAGE_ACCESS image3D kImages3D[];
layout(set = LVK_SET, binding = LVK_BINDING_STORAGE_IMAGES) uniform LVK_IMAGE_ACCESS uimage2D kImagesU2D[];
layout(set = LVK_SET, binding = LVK_BINDING_STORAGE_IMAGES) uniform LVK_IMAGE_ACCESS iimage2D kImagesI2D[];

// A typed, readable and writable view of the storage images; `type` is image2D, uimage2D, image3D and so on.
#define LVK_STORAGE_IMAGES(type, format, name) \
    layout(set = LVK_SET, binding = LVK_BINDING_STORAGE_IMAGES, format) uniform type name[]
#define LVK_STORAGE_IMAGES_2D(format, name) LVK_STORAGE_IMAGES(image2D, format, name)
#define LVK_STORAGE_IMAGES_U2D(format, name) LVK_STORAGE_IMAGES(uimage2D, format, name)
#define LVK_STORAGE_IMAGES_I2D(format, name) LVK_STORAGE_IMAGES(iimage2D, format, name)

// Both the indices and the combined sampler are marked: the indices for drivers that examine the access, the combined
// sampler because the rules of Vulkan examine the combined operand.
#define LVK_SAMPLED(type, images, samplers, tex, smp) \
    nonuniformEXT(type(images[nonuniformEXT(tex)], samplers[nonuniformEXT(smp)]))
#define LVK_2D(tex, smp) LVK_SAMPLED(sampler2D, kTextures2D, kSamplers, tex, smp)
#define LVK_2D_ARRAY(tex, smp) LVK_SAMPLED(sampler2DArray, kTextures2DArray, kSamplers, tex, smp)
#define LVK_3D(tex, smp) LVK_SAMPLED(sampler3D, kTextures3D, kSamplers, tex, smp)
#define LVK_CUBE(tex, smp) LVK_SAMPLED(samplerCube, kTexturesCube, kSamplers, tex, smp)
#define LVK_2D_SHADOW(tex, smp) LVK_SAMPLED(sampler2DShadow, kTextures2D, kSamplersShadow, tex, smp)
#define LVK_2D_ARRAY_SHADOW(tex, smp) LVK_SAMPLED(sampler2DArrayShadow, kTextures2DArray, kSamplersShadow, tex, smp)
#define LVK_CUBE_SHADOW(tex, smp) LVK_SAMPLED(samplerCubeShadow, kTexturesCube, kSamplersShadow, tex, smp)

// Only fragment shaders have derivatives; in other stages the same helper reads mip level 0.
#ifdef LVK_STAGE_FRAGMENT
#define LVK_SAMPLE(sampled, uv) texture(sampled, uv)
#else
#define LVK_SAMPLE(sampled, uv) textureLod(sampled, uv, 0.0)
#endif

vec4 textureBindless2D(uint tex, uint smp, vec2 uv) { return LVK_SAMPLE(LVK_2D(tex, smp), uv); }
vec4 textureBindless2DLod(uint tex, uint smp, vec2 uv, float lod) { return textureLod(LVK_2D(tex, smp), uv, lod); }
vec4 textureBindless2DGrad(uint tex, uint smp, vec2 uv, vec2 dx, vec2 dy) { return textureGrad(LVK_2D(tex, smp), uv, dx, dy); }
vec4 textureBindless2DGather(uint tex, uint smp, vec2 uv) { return textureGather(LVK_2D(tex, smp), uv); }
float textureBindless2DShadow(uint tex, uint smp, vec3 uvw) { return LVK_SAMPLE(LVK_2D_SHADOW(tex, smp), uvw); }

vec4 textureBindless2DGatherShadow(uint tex, uint smp, vec2 uv, float ref) { return textureGather(LVK_2D_SHADOW(tex, smp), uv, ref); }
// The channel (0 to 3) must be a constant.
#define textureBindless2DGatherChannel(tex, smp, uv, channel) textureGather(LVK_2D(tex, smp), uv, channel)
#define textureBindless2DArrayGatherChannel(tex, smp, uvLayer, channel) textureGather(LVK_2D_ARRAY(tex, smp), uvLayer, channel)
#define textureBindlessCubeGatherChannel(tex, smp, dir, channel) textureGather(LVK_CUBE(tex, smp), dir, channel)

vec4 textureBindless2DArray(uint tex, uint smp, vec3 uvLayer) { return LVK_SAMPLE(LVK_2D_ARRAY(tex, smp), uvLayer); }
vec4 textureBindless2DArrayLod(uint tex, uint smp, vec3 uvLayer, float lod) { return textureLod(LVK_2D_ARRAY(tex, smp), uvLayer, lod); }

float textureBindless2DArrayShadow(uint tex, uint smp, vec4 uvLayerRef) { return texture(LVK_2D_ARRAY_SHADOW(tex, smp), uvLayerRef); }

vec4 textureBindless3D(uint tex, uint smp, vec3 uvw) { return LVK_SAMPLE(LVK_3D(tex, smp), uvw); }
vec4 textureBindless3DLod(uint tex, uint smp, vec3 uvw, float lod) { return textureLod(LVK_3D(tex, smp), uvw, lod); }

vec4 textureBindlessCube(uint tex, uint smp, vec3 dir) { return LVK_SAMPLE(LVK_CUBE(tex, smp), dir); }
vec4 textureBindlessCubeLod(uint tex, uint smp, vec3 dir, float lod) { return textureLod(LVK_CUBE(tex, smp), dir, lod); }

float textureBindlessCubeShadow(uint tex, uint smp, vec4 dirRef) { return texture(LVK_CUBE_SHADOW(tex, smp), dirRef); }

vec4 textureBindlessFetch2D(uint tex, ivec2 texel, int lod) { return texelFetch(kTextures2D[nonuniformEXT(tex)], texel, lod); }
uvec4 textureBindlessFetchU2D(uint tex, ivec2 texel, int lod) { return texelFetch(kTexturesU2D[nonuniformEXT(tex)], texel, lod); }
ivec4 textureBindlessFetchI2D(uint tex, ivec2 texel, int lod) { return texelFetch(kTexturesI2D[nonuniformEXT(tex)], texel, lod); }

// These need LVK_TEXTURES(textureCubeArray, kTexturesCubeArray). The fourth coordinate is the index of the cube.
#define LVK_CUBE_ARRAY(tex, smp) LVK_SAMPLED(samplerCubeArray, kTexturesCubeArray, kSamplers, tex, smp)
#define textureBindlessCubeArray(tex, smp, dirCube) LVK_SAMPLE(LVK_CUBE_ARRAY(tex, smp), dirCube)
#define textureBindlessCubeArrayLod(tex, smp, dirCube, lod) textureLod(LVK_CUBE_ARRAY(tex, smp), dirCube, lod)
#define textureBindlessCubeArrayShadow(tex, smp, dirCube, ref) texture(LVK_SAMPLED(samplerCubeArrayShadow, kTexturesCubeArray, kSamplersShadow, tex, smp), dirCube, ref)
#define textureBindlessSizeCubeArray(tex) textureSize(kTexturesCubeArray[nonuniformEXT(tex)], 0)

// These need LVK_TEXTURES(texture1D, kTextures1D).
#define LVK_1D(tex, smp) LVK_SAMPLED(sampler1D, kTextures1D, kSamplers, tex, smp)
#define textureBindless1D(tex, smp, u) LVK_SAMPLE(LVK_1D(tex, smp), u)
#define textureBindless1DLod(tex, smp, u, lod) textureLod(LVK_1D(tex, smp), u, lod)
#define textureBindlessFetch1D(tex, texel, lod) texelFetch(kTextures1D[nonuniformEXT(tex)], texel, lod)
#define textureBindlessSize1D(tex) textureSize(kTextures1D[nonuniformEXT(tex)], 0)

vec4 textureBindlessFetch2DMS(uint tex, ivec2 texel, int smp) { return texelFetch(kTextures2DMS[nonuniformEXT(tex)], texel, smp); }
ivec2 textureBindlessSize2DMS(uint tex) { return textureSize(kTextures2DMS[nonuniformEXT(tex)]); }
int textureBindlessSamples2DMS(uint tex) { return textureSamples(kTextures2DMS[nonuniformEXT(tex)]); }

ivec2 textureBindlessSize2D(uint tex) { return textureSize(kTextures2D[nonuniformEXT(tex)], 0); }
ivec3 textureBindlessSize2DArray(uint tex) { return textureSize(kTextures2DArray[nonuniformEXT(tex)], 0); }
ivec3 textureBindlessSize3D(uint tex) { return textureSize(kTextures3D[nonuniformEXT(tex)], 0); }
ivec2 textureBindlessSizeCube(uint tex) { return textureSize(kTexturesCube[nonuniformEXT(tex)], 0); }
int textureBindlessQueryLevels2D(uint tex) { return textureQueryLevels(kTextures2D[nonuniformEXT(tex)]); }
int textureBindlessQueryLevelsCube(uint tex) { return textureQueryLevels(kTexturesCube[nonuniformEXT(tex)]); }
