// The frame constants of the sample.
#ifndef LARGE_SCENE_FRAME
#define LARGE_SCENE_FRAME

#include "common/camera.glsl"
#include "common/scene_buffers.glsl"

// From an instance's own coordinates to the world's: turned, moved, and scaled alike in all directions.
struct Place {
    vec4 rows[3];
};

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer PlaceArray {
    Place at[]; // of each instance
};

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer FirstArray {
    uint at[]; // first triangle of each piece
};

// The quantity that pixels show.
const uint kShowPicture = 0u;
const uint kShowInstances = 1u;
const uint kShowTriangles = 2u;

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Frame {
    Camera camera;
    Scene scene; // of all pieces
    Light lights[2];
    vec3 ambientAbove;
    uint lightCount;
    vec3 ambientBelow;
    float offsetExtent; // see ray_offset.glsl
    PlaceArray places;
    FirstArray firsts;
    uint tlas;
    uint sky; // index into kTexturesCube
    uint surfaceSampler;
    uint skySampler;
    uint image;
    uint depth; // how often a ray may be mirrored or bent
    uint samples; // rays of each pixel
    uint show;
};

layout(push_constant, scalar) uniform PushConstants {
    Frame frame;
};

#endif
