// A pinhole camera that gives the rasteriser and the ray generator the same place in each pixel.
#ifndef COMMON_CAMERA
#define COMMON_CAMERA

struct Camera {
    vec3 eye;
    float nearPlane; // distance along `forward`
    vec3 forward; // unit length
    float pixelSpread; // growth of a pixel's footprint per unit of distance
    vec3 right; // scaled to half the image plane's width at distance 1
    uint width;
    vec3 down; // scaled to half the image plane's height at distance 1
    uint height;
    vec3 clipRight; // `right` over its squared length: gives clip x
    vec3 clipDown; // likewise for clip y
    vec2 shift; // of the places that pixels are seen at, in clip space: for samples beside a pixel's centre
};

vec3 cameraDirection(Camera camera, uvec2 pixel) {
    vec2 ndc = (vec2(pixel) + 0.5) / vec2(camera.width, camera.height) * 2.0 - 1.0 + camera.shift;
    return normalize(camera.forward + ndc.x * camera.right + ndc.y * camera.down);
}

// Distance along `direction` at which the rasteriser's near plane cuts.
float cameraNearDistance(Camera camera, vec3 direction) {
    return camera.nearPlane / dot(direction, camera.forward);
}

// Clip position with reversed depth and no far plane: depth is 1 at the near plane and 0 at infinity.
vec4 cameraClip(Camera camera, vec3 position) {
    vec3 offset = position - camera.eye;
    float depth = dot(offset, camera.forward);
    vec2 place = vec2(dot(offset, camera.clipRight), dot(offset, camera.clipDown)) - depth * camera.shift;
    return vec4(place, camera.nearPlane, depth);
}

#endif
