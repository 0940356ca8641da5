// The frame constants of the sample. The scene has all pieces.
#ifndef LARGE_SCENE_FRAME
#define LARGE_SCENE_FRAME

#include "common/camera.glsl"
#include "common/scene_buffers.glsl"

// From an instance's own coordinates to the world's: turned, moved, and scaled alike in all directions.
struct Place {
    vec4 rows[3];
};

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer PlaceArray { Place at[]; }; // of each instance

// First triangle of each piece.
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer FirstArray { uint at[]; };

// The quantity that pixels show.
const uint kShowPicture = 0u, kShowInstances = 1u, kShowTriangles = 2u;

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Frame {
#include "common/scene_frame.glsl"
    PlaceArray places;
    FirstArray firsts;
    uint image;
    uint depth; // how often a ray may be mirrored or bent
    uint samples; // rays of each pixel
    uint show;
};

layout(push_constant, scalar) uniform PushConstants { Frame frame; };

#endif
