// The frame constants of the sample: one block by address, the rest by push constants.
#ifndef HYBRID_FRAME
#define HYBRID_FRAME

#include "common/camera.glsl"
#include "common/scene_buffers.glsl"
#include "hybrid/reflective_pixels.glsl"
#include "hybrid/pixel_order.glsl"
#include "hybrid/visibility.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Frame {
#include "common/scene_frame.glsl"
    uint outputImage;
    uint gbufferPosition;
    uint gbufferSurface;
    uint gbufferAlbedo;
    Visibility visibility;
    BounceQueue bounces;
    PixelOrder order;
    ColorArray sums; // of the samples so far, a colour a pixel
    uint sampleNumber;
    uint sampleCount;
    uvec2 padding;
};

layout(push_constant, scalar) uniform PushConstants {
    Frame frame;
    uint first; // row of the rows of the image that this launch renders, or place in the order of pixels
    uint end; // of it
};

#endif
