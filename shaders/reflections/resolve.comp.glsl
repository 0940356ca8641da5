// Averages the samples of each pixel, as they would be seen, and writes the picture after the last one.
#include "common/tonemap.glsl"
#include "reflections/frame.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(buffer_reference, scalar, buffer_reference_align = 16) buffer Sums { vec4 at[]; };

const float kExposure = 0.68;

// The curve of a film: dark tones keep their contrast, bright ones roll off (Narkowicz's fit of ACES).
vec3 develop(vec3 x) {
    return clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), vec3(0.0), vec3(1.0));
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (pixel.x >= frame.camera.width || pixel.y >= frame.camera.height) {
        return;
    }
    Sums sums = Sums(uvec2(passArguments[0], passArguments[1]));
    uint sampleCount = passArguments[2];
    uint place = pixel.y * frame.camera.width + pixel.x;
    vec3 color = develop(kExposure * textureBindlessFetch2D(frame.composite, ivec2(pixel), 0).rgb);
    vec3 sum = color + (frame.sampleNumber == 0u ? vec3(0.0) : sums.at[place].rgb);
    if (frame.sampleNumber + 1u < sampleCount) {
        sums.at[place] = vec4(sum, 0.0);
        return;
    }
    vec3 picture = encodeSrgb(sum / float(sampleCount));
    imageStore(kImages2D[frame.picture], ivec2(pixel), vec4(picture, 1.0));
}
