// Samples of the pixels of an invocation: paths from the camera, in one loop.
#ifndef VIEWER_SAMPLE_PATHS
#define VIEWER_SAMPLE_PATHS

#include "viewer/path.glsl"
#include "viewer/pixel_loop.glsl"

// Samples of a pixel are spread over all of it.
Path samplePath(uvec2 pixel, inout Random random) {
    vec2 ndc = (vec2(pixel) + nextPair(random)) / vec2(frame.camera.width, frame.camera.height) * 2.0 - 1.0;
    return cameraPath(normalize(frame.camera.forward + ndc.x * frame.camera.right + ndc.y * frame.camera.down));
}

void samplePaths() {
    uint pixels = pixelCount();
    vec4 sum = vec4(0.0); // radiance, and rays
    Path path;
    Random random;
    bool isUnderWay = false;
    uint sampled = 0u; // paths of the pixel
    for (uint i = 0u; i < pixels;) {
        uvec2 pixel = pixelAt(i);
        uint place = pixel.y * frame.camera.width + pixel.x;
        if (!isUnderWay) {
            if (!isInPicture(pixel)) {
                ++i;
                continue;
            }
            if (sampled == 0u) {
                sum = frame.sampleNumber == 0u ? vec4(0.0) : frame.sums.at[place];
            }
            random = randomOf(pixel, frame.sampleNumber + sampled);
            path = samplePath(pixel, random);
        }
        isUnderWay = advance(path, random);
        if (!isUnderWay) {
            sum += vec4(radianceOf(path), float(path.rayCount));
            sampled += 1u;
            if (sampled == frame.sampleCount) {
                frame.sums.at[place] = sum;
                sampled = 0u;
                ++i;
            }
        }
    }
}

#endif
