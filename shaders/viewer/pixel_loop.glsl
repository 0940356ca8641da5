// The pixels of an invocation, whose paths share a loop: pixelCount() and pixelAt(). Where a path ends the next begins, so that
// invocations that run together wait for their sums of paths and not for the longest path of each pixel (Novak et al., "Path
// Regeneration for Interactive Path Tracing", 2010). On a GPU they lie below each other, as far apart as the launch has rows. On a CPU
// they are those of the block of the work group. A ray generation shader has one pixel: drivers schedule its paths themselves.
#ifndef VIEWER_PIXEL_LOOP
#define VIEWER_PIXEL_LOOP

#include "viewer/frame.glsl"

#ifdef VIEWER_RAYGEN

uint pixelCount() {
    return 1u;
}

uvec2 pixelAt(uint i) {
    return gl_LaunchIDEXT.xy;
}

#else

#include "common/group_pixel.glsl"

#ifdef LVK_DEVICE_IS_CPU

uint pixelCount() {
    return kGroupPixels;
}

uvec2 pixelAt(uint i) {
    return groupPixel() + groupStep(i);
}

#else

uint launchRows() {
    return gl_NumWorkGroups.y * gl_WorkGroupSize.y;
}

uint pixelCount() {
    return (frame.camera.height + launchRows() - 1u) / launchRows();
}

uvec2 pixelAt(uint i) {
    return groupPixel() + uvec2(0u, i * launchRows());
}

#endif

#endif

bool isInPicture(uvec2 pixel) {
    return pixel.x < frame.camera.width && pixel.y < frame.camera.height;
}

#endif
