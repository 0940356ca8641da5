// The frame constants of the sample.
#ifndef MESH_SHADERS_FRAME
#define MESH_SHADERS_FRAME

#include "common/camera.glsl"
#include "common/vertices.glsl"

// Some triangles that lie side by side.
struct Meshlet {
    vec3 middle;
    float radius; // of a sphere around all corners
    vec3 axis; // of a cone around all normals
    float cutoff; // sine of its half angle; 1 where the normals go too far apart
    uint firstVertex;
    uint vertexCount;
    uint firstTriangle;
    uint triangleCount;
};

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Meshlets { Meshlet at[]; };
// Places in `VertexArray`, and triangles of three places of one byte in those.
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Numbers { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Counter { uint drawn; };

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Frame {
    Camera camera;
    Camera cullingCamera; // what is culled cannot be seen from here
    Meshlets meshlets;
    VertexArray vertices;
    Numbers vertexNumbers;
    Numbers triangles;
    Counter counter;
    uint count; // of meshlets
    uint culls; // 1 where meshlets that cannot be seen are left out
    float phase; // of the animation's round, 0 to 1
    float apart; // how far meshlets move outwards
};

layout(push_constant, scalar) uniform Push { Frame frame; };

// About the upright axis, with the animation.
vec3 turned(vec3 direction) {
    float angle = 6.2831853 * frame.phase;
    return vec3(cos(angle) * direction.x + sin(angle) * direction.z, direction.y, cos(angle) * direction.z - sin(angle) * direction.x);
}

// Displacement of a meshlet: waves run along the knot.
vec3 movedBy(uint number) {
    float wave = 0.5 + 0.5 * sin(6.2831853 * (2.0 * float(number) / float(frame.count) - 2.0 * frame.phase));
    return frame.apart * wave * wave * wave * frame.meshlets.at[number].axis;
}

#endif
