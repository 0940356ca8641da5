// A scene as the GPU sees it: plain arrays reached by device address.
#ifndef COMMON_SCENE_BUFFERS
#define COMMON_SCENE_BUFFERS

#include "common/arrays.glsl"
#include "common/no_texture.glsl"

struct Material {
    vec3 albedo; // linear, multiplied with the texture
    uint albedoTexture; // index into kTextures2D, or kNoTexture
    vec3 specular;
    float shininess;
    vec3 emission;
    float reflectivity; // share of mirror reflection, 0..1
    vec3 tint; // colour of mirrored and refracted light
    float transmission; // share of light that passes, 0..1
    float ior;
};

struct TriangleInfo {
    uint material;
    float lodConstant; // log2 of texels per unit of length, see texture_lod.glsl
};

struct Light {
    vec3 position; // for a distant light the unit vector towards it
    float isDistant; // 0 or 1
    vec3 color;
    float reach; // distance at which a point light has fallen to half
};

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer TriangleInfoArray { TriangleInfo at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer MaterialArray { Material at[]; };

struct Scene {
    Vec3Array positions;
    Vec3Array normals;
    Vec2Array texcoords;
    TriangleArray triangles;
    TriangleInfoArray triangleInfos;
    MaterialArray materials;
    uvec2 colors; // address of a Vec3Array, linear, one for each vertex; 0 if all are white
};

#endif
