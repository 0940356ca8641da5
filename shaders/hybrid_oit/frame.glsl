// The frame constants of the sample: one block by address, the time by push constants.
#ifndef HYBRID_OIT_FRAME
#define HYBRID_OIT_FRAME

#include "common/camera.glsl"

// Motion and colour of a sphere; see `Sphere` in the sample's scene. Angles in radians, rates in turns a second.
struct Motion {
    vec3 anchor; // for a ball the lowest place of its centre
    float radius;
    vec3 color; // a ball's albedo, or what glass absorbs of red, green and blue in a unit of length
    float height; // of the bounces, or how far glass bobs up and down
    vec2 orbit; // half axes of the ellipse around the anchor, along x and z
    float orbitRate;
    float orbitPhase; // in turns, as the next
    float heightPhase;
    float heightRate;
};

struct Sphere {
    vec3 center;
    float radius;
    vec3 color; // as of Motion
    uint isGlass;
};

// Six vertices of a flat side of the floor or of a block.
struct Face {
    vec3 normal;
    vec3 albedo;
};

struct Block {
    vec3 low;
    vec3 high;
};

// A point of a pixel's list where light passes glass: what it adds, and what is left of the light from behind.
struct Node {
    uint next; // or kNoNode
    float distance; // along the pixel's ray
    uvec3 packed; // radiance and transmittance: six half floats
};

const uint kNoNode = 0xffffffffu;

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer MotionArray { Motion at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer SphereArray { Sphere at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer FaceArray { Face at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer BlockArray { Block at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer PositionArray { vec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer NodeArray { Node at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer WordArray { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer ColorArray { vec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer BoxArray { vec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) writeonly buffer RecordArray { uvec4 at[]; };

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Frame {
    Camera camera; // of the image that is rasterised, `supersampling` times as wide and high as the picture
    vec3 sunDirection; // towards the sun, unit length
    float sunRadius; // of its disc at distance 1
    vec3 sunColor;
    float offsetExtent; // see ray_offset.glsl
    MotionArray motions;
    SphereArray spheres; // balls first, then glass
    FaceArray faces;
    PositionArray positions;
    BlockArray blocks;
    BoxArray boxes; // two corners for each sphere of glass
    RecordArray records; // four words of 16 bytes for each instance
    WordArray heads; // first node of each pixel's list
    WordArray nodeCount; // nodes asked for, which may be more than there are
    NodeArray nodes;
    ColorArray glassLight; // sunlight that reaches each sphere of glass
    uint ballCount;
    uint glassCount;
    uint blockCount;
    uint nodeCapacity;
    uint shadowRays;
    uint supersampling;
    uint tlas;
    uint gbufferPosition;
    uint gbufferSurface;
    uint shadowImage; // for stores
    uint shadowTexture; // for fetches
    uint outputImage;
};

layout(push_constant, scalar) uniform PushConstants {
    Frame frame;
    float time; // in seconds
};

#endif
