// The frame constants of all stages, and positions of the lights.
#ifndef DEFERRED_FRAME
#define DEFERRED_FRAME

#include "common/camera.glsl"

struct Vertex {
    vec3 position;
    vec3 normal;
    uint material;
};
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Vertices { Vertex at[]; };

struct Material {
    vec3 albedo;
    float roughness;
    float metalness;
    float tiles; // a side of a tile, or 0
};
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Materials { Material at[]; };

layout(buffer_reference, scalar) readonly buffer Frame {
    Camera camera;
    Vertices vertices;
    Materials materials;
    uint albedo; // textures of the way by several passes
    uint normal;
    uint lit;
    uint depth;
    uint nearest; // a sampler
    uint lightCount;
    uint view;
    float phase; // of the animation's round, 0 to 1
    float power; // of each light
    float exposure;
};
layout(push_constant, scalar) uniform Push { Frame frame; };

const float kTau = 6.28318530718;
const float kOrbRadius = 0.045;

struct PointLight {
    vec3 position;
    float reach; // it lights nothing beyond
    vec3 color;
};

const vec3 kColors[6] = vec3[](vec3(1.0, 0.42, 0.08), vec3(1.0, 0.62, 0.22), vec3(1.0, 0.16, 0.1), vec3(0.1, 0.65, 1.0),
                               vec3(0.5, 0.2, 1.0), vec3(0.12, 1.0, 0.45));

// A light that floats about its own place in the hall. Places are those of the R3 sequence, which fills space evenly
// whatever the number of lights.
PointLight lightAt(uint number) {
    vec3 place = fract(0.5 + vec3(0.8191725, 0.6710436, 0.5497005) * float(number % 4096u));
    vec3 home = vec3(mix(-10.5, 10.5, place.x), 0.22 + 4.2 * place.y * place.y, mix(-27.0, 7.5, place.z));
    float turn = kTau * (frame.phase * float(1u + number % 2u) + 7.0 * place.x);
    PointLight light;
    light.position = home + vec3(0.55 * cos(turn), 0.18 * sin(2.0 * turn), 0.55 * sin(turn));
    light.reach = mix(1.5, 3.0, fract(5.0 * place.z + 3.0 * place.y));
    // Warm near the ground, and cold above.
    uint cold = fract(11.0 * place.z) < 0.25 + 0.5 * place.y ? 3u : 0u;
    light.color = frame.power * light.reach * kColors[cold + number % 3u];
    return light;
}

// The ends of directions that the camera's image plane spans, of unit length.
vec3 cameraRight() { return normalize(frame.camera.right); }
vec3 cameraDown() { return normalize(frame.camera.down); }

#endif
