// The frame constants of the sample.
#ifndef RTX_TEXTURES_FRAME
#define RTX_TEXTURES_FRAME

#include "common/arrays.glsl"
#include "common/camera.glsl"

struct Vertex {
    vec3 position;
    vec3 normal;
    vec2 texcoord;
};

// An instance as Vulkan reads it, with the place of its model in place of an address.
struct Record {
    vec4 rows[3];
    uint customIndexAndMask;
    uint hitGroupAndFlags;
    uint model;
    uint modelHigh;
};

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer VertexArray { Vertex at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) writeonly buffer RecordArray { Record at[]; };

// Models, and places of hit groups in the pipeline, which queries tell apart by.
const uint kGround = 0u, kCrate = 1u, kRing = 2u;
const uint kPainted = 0u, kGlazed = 1u;

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Frame {
    Camera camera;
    VertexArray vertices;
    TriangleArray triangles;
    RecordArray records;
    uint textures[6]; // indices into kTextures2D
    uint firstTriangle[3]; // of each model
    uint tlas;
    uint image;
    uint smp;
    uint count; // of instances
    float phase; // of the animation's round, 0 to 1
};

layout(push_constant, scalar) uniform PushConstants { Frame frame; };

#endif
