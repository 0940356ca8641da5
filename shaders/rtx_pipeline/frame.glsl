// The frame constants of the sample.
#ifndef RTX_PIPELINE_FRAME
#define RTX_PIPELINE_FRAME

#include "common/camera.glsl"
#include "common/scene_buffers.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Frame {
#include "common/scene_frame.glsl"
    uint image;
    uint depth; // how often a ray may be mirrored or bent
};

layout(push_constant, scalar) uniform PushConstants { Frame frame; };

#endif
