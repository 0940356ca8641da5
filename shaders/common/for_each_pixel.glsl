// The main function of a compute stage that calls PIXEL_FUNCTION for each pixel of the image of frame.camera.
#include "common/group_pixel.glsl"

void main() {
    uvec2 first = groupPixel();
    [[dont_unroll]] for (uint i = 0u; i < kGroupPixels; ++i) {
        uvec2 pixel = first + groupStep(i);
        if (pixel.x < frame.camera.width && pixel.y < frame.camera.height) {
            PIXEL_FUNCTION(pixel);
        }
    }
}
