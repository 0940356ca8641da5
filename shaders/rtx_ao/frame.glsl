// The frame constants of the sample.
#ifndef RTX_AO_FRAME
#define RTX_AO_FRAME

#include "common/arrays.glsl"
#include "common/camera.glsl"
#include "common/no_texture.glsl"

struct Paint {
    vec3 albedo; // linear, multiplied with the texture
    uint tex; // index into kTextures2D, or kNoTexture
};

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer PaintArray { Paint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) buffer SumArray { vec4 at[]; };

// Addresses are numbers: SwiftShader miscompiles copies of structs that hold buffer references.
struct Body {
    vec4 rows[3]; // to the world
    uvec2 positions;
    uvec2 normals;
    uvec2 texcoords;
    uvec2 triangles;
    uvec2 paints; // one for each triangle
    uvec2 colors; // of vertices, linear; 0 if all are white
};

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer BodyArray { Body at[]; };

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Frame {
    Camera camera;
    BodyArray bodies;
    SumArray sums; // the cache: radiance and openness of all passes, for each pixel
    vec3 toSun;
    float sunSpread; // radius of the sun's disc at distance 1
    vec3 sunColor;
    float radius; // within which surroundings darken a surface
    vec3 ambientAbove;
    uint tlas;
    vec3 ambientBelow;
    uint image;
    uint smp;
    uint albedo; // the targets, as textures
    uint light;
    uint position;
    uint normal;
    uint geometric;
    uint pass; // since camera and geometry are what they are
    uint rays; // to the surroundings, of each pixel and pass
    float lift; // of rays off the surface they leave
};

layout(push_constant, scalar) uniform PushConstants {
    Frame frame;
    uint body;
};

#endif
