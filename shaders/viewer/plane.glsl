// Data of the real-time method for each pixel, in planes of one vec4 a pixel each, and what the picture can show of them.
#ifndef VIEWER_PLANE
#define VIEWER_PLANE

#include "common/octahedral.glsl"
#include "viewer/frame.glsl"

const uint kViewLight = 0u;
const uint kViewNormals = 1u;
const uint kViewRoughness = 2u;
const uint kViewMotion = 3u;
const uint kViewAlbedo = 4u;
const uint kViewMatte = 5u; // light of matte layers, filtered
const uint kViewMirrored = 6u; // all other light, filtered
const uint kViewSteps = 7u; // steps of rays, which another pass counts

// Two planes of the same kind are those of this frame and of the one before, in turn.
const uint kPlaneSurface = 0u; // and 1: normal, distance, instance, roughness
const uint kPlaneMatteHistory = 2u; // and 3: mean light of matte layers over their albedo, and the number of samples in it
const uint kPlaneMirroredHistory = 4u; // and 5: likewise all other light over its share
const uint kPlaneMoments = 6u; // and 7: means of both brightnesses and of their squares
const uint kPlaneColor = 8u; // and 9: means of pictures, and the number of frames in it
const uint kPlaneMatte = 10u; // and 11: light on its way through the filter, and its variance
const uint kPlaneMirrored = 12u; // and 13: likewise
const uint kPlaneMatteAlbedo = 14u;
const uint kPlaneMirroredShare = 15u;
const uint kPlaneBase = 16u; // light that needs no filter
const uint kPlaneFrame = 17u; // the picture of this frame
const uint kPlaneBefore = 18u; // where the point that the pixel shows was in the frame before, and how far its surface has turned since
const uint kPlaneShown = 19u;

// In the last component of kPlaneMatte: the pixel has found no light in this frame.
const float kNoSample = -1.0;

bool isSample(vec4 matte) {
    return matte.a != kNoSample;
}

uint pixelPlace(ivec2 pixel) {
    return uint(pixel.y) * frame.camera.width + uint(pixel.x);
}

// An element of a plane; those of the frame before come from the other of a pair.
uint planePlace(uint plane, uint place) {
    return plane * frame.camera.width * frame.camera.height + place;
}

uint currentPlane(uint plane, uint place) {
    return planePlace(plane + (frame.frameNumber & 1u), place);
}

uint previousPlane(uint plane, uint place) {
    return planePlace(plane + 1u - (frame.frameNumber & 1u), place);
}

// The sky is as far away as numbers allow, in distances of the near plane.
const float kSkyDistance = 1e6;

// What a pixel shows, as far as later passes need to know it.
struct Seen {
    vec3 normal;
    float distance; // from the eye; below 0 where the pixel shows the sky
    uint instance; // the lowest 16 bits of its number
    float roughness;
};

vec4 packedSeen(Seen seen) {
    // A float has room for 16 bits of a number and 8 of a fraction.
    float number = float(seen.instance & 0xffffu) + clamp(seen.roughness, 0.0, 1.0) * (255.0 / 256.0);
    return vec4(octahedralFromUnit(seen.normal), seen.distance, number);
}

Seen unpackedSeen(vec4 packed) {
    return Seen(unitFromOctahedral(packed.xy), packed.z, uint(packed.w), fract(packed.w) * (256.0 / 255.0));
}

bool isSky(Seen seen) {
    return seen.distance < 0.0;
}

// The point that a pixel shows. Pixels of a frame are seen at places that are shifted within them.
vec3 seenPoint(Camera camera, ivec2 pixel, float distance) {
    return camera.eye + distance * cameraDirection(camera, uvec2(pixel));
}

// The place of a point in pixels.
vec2 placeOf(Camera camera, vec3 point) {
    vec4 clip = cameraClip(camera, point);
    return (clip.xy / max(clip.w, 1e-6) * 0.5 + 0.5) * vec2(camera.width, camera.height);
}

// Pixels that what a pixel shows has moved since the frame before.
vec2 motionOf(vec3 point, vec3 pointBefore) {
    return placeOf(frame.seen, point) - placeOf(frame.seenBefore, pointBefore);
}

float brightness(vec3 color) {
    return dot(color, vec3(0.2126, 0.7152, 0.0722));
}

#endif
