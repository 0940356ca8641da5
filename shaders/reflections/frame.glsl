// The frame constants of the sample: one block by address, the rest by push constants.
#ifndef REFLECTIONS_FRAME
#define REFLECTIONS_FRAME

#include "common/camera.glsl"
#include "common/no_texture.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Words { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Floats { float at[]; };

struct Material {
    vec3 albedo; // linear, multiplied with the texture
    float roughness; // multiplied with the texture's alpha
    vec3 emission;
    float metalness;
    uint albedoTexture; // index into kTextures2D, or kNoTexture
    float texelsPerUnit; // of length, of the texture's first mip
    float opacity; // 1 for opaque surfaces
    float density; // of a body of water, per unit of length; 0 for what has no depth
};

// Memory layout of the vertices of a geometry.
const uint kKindStatic = 0u; // 16 bytes: snorm16 position, octahedral normal, half texture coordinates
const uint kKindSkinned = 1u; // float positions in the world, octahedral normals in an array of their own
const uint kKindLeaf = 2u; // float positions in the world, four for each quad

// Addresses of Words, as numbers: SwiftShader miscompiles copies of structs that hold buffer references.
struct Geometry {
    uvec2 vertices;
    uvec2 normals;
    uvec2 indices; // 16 bits each
    uint material;
    uint kind;
};

struct Instance {
    vec4 rows[3]; // from snorm16 positions to the world
    vec3 normalColumns[3]; // from the normals of the model to the world
    uint firstGeometry;
};

struct Light {
    vec3 position; // or the unit vector towards a distant light
    float radius; // of the lamp; 0 for a distant light
    vec3 color;
    float spread; // sine of half the angle of a distant light
};

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer MaterialArray { Material at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer GeometryArray { Geometry at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer InstanceArray { Instance at[]; };

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Frame {
    Camera camera;
    MaterialArray materials;
    GeometryArray geometries;
    InstanceArray instances;
    Light lights[3]; // as many as visibility.glsl has channels for
    vec3 harmonics[9]; // radiance of the sky, in spherical harmonics
    uint lightCount;
    uint frameNumber;
    uint sampleNumber;
    float phase; // of the animation's round, 0 to 1
    uint tlas;
    uint sky; // index into kTexturesCube
    uint skySampler;
    uint surfaceSampler;
    uint opaqueSurface; // the g-buffers: see gbuffer.glsl
    uint opaqueDepth;
    uint glassSurface;
    uint glassDepth;
    uint visibility; // of each light, and how open the surroundings are: see visibility.glsl
    uint smoothed; // the same, on its way through the filter
    uint penumbra;
    uint reflection; // radiance and hit distance
    uint filtered;
    uint glassReflection;
    uint composite;
    uint picture;
};

layout(push_constant, scalar) uniform PushConstants {
    Frame frame;
    uint passArguments[4];
};

// Distance along `direction` of what has this depth, which counts down from 1 at the near plane to 0.
float depthDistance(float depth, vec3 direction) {
    return frame.camera.nearPlane / (depth * dot(direction, frame.camera.forward));
}

#endif
