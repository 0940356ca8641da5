// The frame constants of the sample.
#ifndef OMNI_SHADOWS_FRAME
#define OMNI_SHADOWS_FRAME

#include "common/camera.glsl"
#include "common/vertices.glsl"

struct Instance {
    vec4 rows[3]; // world from model
    vec3 color;
    uint material;
};

// Numbers of vertices, three for each triangle.
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer CornerArray { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer InstanceArray { Instance at[]; };

// Materials, and ways to filter the shadow.
const uint kPlaster = 0u, kTiles = 1u, kMetal = 2u, kGlaze = 3u, kGlow = 4u;
const uint kUnshadowed = 0u, kHard = 1u, kLinear = 2u, kSoft = 3u;

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Frame {
    Camera camera;
    VertexArray vertices;
    CornerArray corners;
    InstanceArray instances;
    vec3 light; // where the lamp is
    float lampNear; // distance from the lamp at which its depth is 1; it falls to 0 far away
    vec3 intensity;
    float bulb; // radius of the lamp, which makes soft shadows
    vec3 room; // half its width, its height, half its length
    float haze; // how thick the air is
    uint cube; // depth around the lamp
    uint nearestComparing; // samplers
    uint linearComparing;
    uint reading;
    uint faces[6]; // the cube's, one by one
    uint filtering;
    float texel; // width of the cube's texels at distance 1
};

layout(push_constant, scalar) uniform PushConstants {
    Frame frame;
    uint face; // of the cube, where each is drawn by itself
};

vec3 toWorld(Instance thing, vec3 point) {
    vec4 p = vec4(point, 1.0);
    return vec3(dot(thing.rows[0], p), dot(thing.rows[1], p), dot(thing.rows[2], p));
}

#endif
