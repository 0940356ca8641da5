// The payload of a shadow ray.
#ifndef HYBRID_OIT_PAYLOAD
#define HYBRID_OIT_PAYLOAD

struct Sunlight {
    uvec3 opticalDepth; // of all glass on the way; see sphere.glsl
    uint isBlocked;
};

#endif
