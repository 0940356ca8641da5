// A ball under a pixel, for the depth pass and the G-buffer pass.
#ifndef HYBRID_OIT_BALL
#define HYBRID_OIT_BALL

#include "hybrid_oit/sphere.glsl"

vec3 pixelRay() {
    return cameraDirection(frame.camera, uvec2(gl_FragCoord.xy));
}

Crossing ballCrossing(Sphere sphere, vec3 direction) {
    Crossing crossing;
    if (!crossSphere(sphere.center, sphere.radius, frame.camera.eye, direction, crossing)) {
        discard;
    }
    return crossing;
}

// Depth in units of the depth buffer, `steps` of its last place nearer. The G-buffer pass tests for at least as near,
// and its compiler may round otherwise than that of the depth pass.
float ballDepth(Crossing crossing, uint steps) {
    precise float along = crossing.entry * dot(pixelRay(), frame.camera.forward);
    precise float depth = frame.camera.nearPlane / along;
    return uintBitsToFloat(floatBitsToUint(depth) + steps);
}

#endif
