// The frame constants of the sample.
#ifndef RTX_PIPELINE_FRAME
#define RTX_PIPELINE_FRAME

#include "common/camera.glsl"
#include "common/scene_buffers.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Frame {
    Camera camera;
    Scene scene;
    Light lights[2];
    vec3 ambientAbove;
    uint lightCount;
    vec3 ambientBelow;
    float offsetExtent; // see ray_offset.glsl
    uint tlas;
    uint sky; // index into kTexturesCube
    uint surfaceSampler;
    uint skySampler;
    uint image;
    uint depth; // how often a ray may be mirrored or bent
};

layout(push_constant, scalar) uniform PushConstants {
    Frame frame;
};

#endif
