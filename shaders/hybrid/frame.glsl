// What every shader of the sample is told: one block of constants by address, the rest by push constants.
#ifndef HYBRID_FRAME
#define HYBRID_FRAME

#include "common/camera.glsl"
#include "common/scene_buffers.glsl"
#include "hybrid/bounce_queue.glsl"
#include "hybrid/visibility.glsl"

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
    uint outputImage;
    uint gbufferPosition;
    uint gbufferSurface;
    uint gbufferAlbedo;
    Visibility visibility;
    BounceQueue bounces;
    ColorArray sums; // of the samples so far, a colour a pixel
    uint sampleNumber;
    uint sampleCount;
};

layout(push_constant, scalar) uniform PushConstants {
    Frame frame;
    uint firstRow; // of the band of the image that this launch renders
    uint endRow;
};

#endif
