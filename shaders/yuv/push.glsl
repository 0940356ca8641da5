// The push constants of the sample.
#ifndef YUV_PUSH
#define YUV_PUSH

layout(push_constant, scalar) uniform Push {
    vec2 covered; // part of the canvas that the picture covers
    uint planes[3]; // textures of Y, Cb and Cr
    uint channels[3]; // of them
    uint smp;
};

#endif
