// The pixels of an invocation, whose paths share a loop: pixelCount() and pixelAt(). On a GPU they lie below each other, as far apart
// as the launch has rows. On a CPU they are those of the block of the work group.
#ifndef VIEWER_PIXEL_LOOP
#define VIEWER_PIXEL_LOOP

#include "viewer/frame.glsl"

#ifdef VIEWER_RAYGEN

uvec2 firstPixel() {
    return gl_LaunchIDEXT.xy;
}

uint launchRows() {
    return gl_LaunchSizeEXT.y;
}

#else

#include "common/group_pixel.glsl"

uvec2 firstPixel() {
    return groupPixel();
}

uint launchRows() {
    return gl_NumWorkGroups.y * gl_WorkGroupSize.y;
}

#endif

#if defined(LVK_DEVICE_IS_CPU) && !defined(VIEWER_RAYGEN)

uint pixelCount() {
    return kGroupPixels;
}

uvec2 pixelAt(uint i) {
    return firstPixel() + groupStep(i);
}

#else

uint pixelCount() {
    return (frame.camera.height + launchRows() - 1u) / launchRows();
}

uvec2 pixelAt(uint i) {
    return firstPixel() + uvec2(0u, i * launchRows());
}

#endif

bool isInPicture(uvec2 pixel) {
    return pixel.x < frame.camera.width && pixel.y < frame.camera.height;
}

#endif
