// The frame constants of the sample.
#ifndef RENDER_TO_CUBE_MAP_FRAME
#define RENDER_TO_CUBE_MAP_FRAME

#include "common/camera.glsl"

// A block of the surroundings, upright, turned about its own axis.
struct Block {
    vec3 middle;
    uint isFloor; // 1 where it has squares in place of its colour
    vec3 halfSize;
    float turn; // radians
    vec3 color;
    uint padding;
};

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Blocks { Block at[]; };

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Frame {
    Camera cameras[7]; // of the cube map's faces, and of the picture
    Blocks blocks;
    uint cubeMap;
    uint smp;
    float phase; // of the animation's round, 0 to 1
    float waves; // height of the waves on the drop, of its radius
    float lod; // mip of the cube map that is reflected
};

layout(push_constant, scalar) uniform Push {
    Frame frame;
    uint view; // which camera, where a pass has one
};

const uint kPicture = 6u;
const vec3 kDrop = vec3(0.0, 1.35, 0.0); // its middle, where the cube map is drawn from
const float kRadius = 1.0;

#endif
