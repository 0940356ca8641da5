// The hit of a ray.
#ifndef LARGE_SCENE_HIT
#define LARGE_SCENE_HIT

const uint kNothing = 0xffffffffu;

struct Hit {
    uint triangle; // of the whole scene, or kNothing
    uint instance;
    vec2 barycentrics;
};

#endif
