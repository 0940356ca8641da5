// The picture of the mean of all samples.
#include "viewer/frame.glsl"
#include "viewer/tone.glsl"

void presentPixel(uvec2 pixel) {
    vec3 sum = frame.sums.at[pixel.y * frame.camera.width + pixel.x].rgb;
    vec3 mean = sum / float(frame.sampleNumber + frame.sampleCount);
    imageStore(kImages2D[frame.image], ivec2(pixel), vec4(displayed(mean, frame.exposure, frame.toneMapping), 1.0));
}

#define PIXEL_FUNCTION presentPixel
#include "common/for_each_pixel.glsl"
