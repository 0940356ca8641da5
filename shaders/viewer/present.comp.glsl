// The picture of the mean of all samples, or of data about them. `argument`: number of samples.
#include "viewer/plane.glsl"
#include "viewer/tone.glsl"

void presentPixel(uvec2 pixel) {
    vec3 mean = frame.sums.at[pixel.y * frame.camera.width + pixel.x].rgb / float(argument);
    vec3 shown = frame.view == kViewLight ? displayed(mean, frame.exposure, frame.toneMapping) : encodeSrgb(clamp(mean, 0.0, 1.0));
    imageStore(kImages2D[frame.image], ivec2(pixel), vec4(shown, 1.0));
}

#define PIXEL_FUNCTION presentPixel
#include "common/for_each_pixel.glsl"
