// The frame constants of the sample.
#ifndef SPONZA_FRAME
#define SPONZA_FRAME

#include "common/camera.glsl"
#include "common/scene_buffers.glsl"

// Triangles that are drawn together, and the box around them.
struct Draw {
    vec3 low;
    uint firstVertex;
    vec3 high;
    uint vertexCount;
};

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer DrawArray { Draw at[]; };

// Vertices, instances, first vertex and first instance of an indirect draw.
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer ArgumentArray { uvec4 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer CountArray { uint at[]; }; // of each view

// Material data of this sample beside those of all samples.
struct Finish {
    uint isMasked; // whether its texture's alpha cuts holes
    uint normalMap; // or kNoTexture
};

// Of each material.
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer FinishArray { Finish at[]; };

struct View {
    vec4 planes[6]; // whose inner side is seen
    ArgumentArray arguments;
};

struct Sun {
    vec4 rows[3]; // from the world to clip coordinates of the shadow map
    vec3 direction; // towards it
    uint map;
    vec3 color;
    uint smp; // compares
    vec3 ambientAbove;
    uint pcf; // texels to each side that shadows are filtered over
    vec3 ambientBelow;
    float texel; // of the map, of its width
    vec3 lamp; // where scenes without a sun of their own have it; it casts no shadows
    float lampReach;
    vec3 lampColor;
    float texelSize; // in scene units
};

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Frame {
    Camera camera;
    Scene scene;
    FinishArray finishes;
    DrawArray draws;
    View views[2]; // of the camera and of the sun
    CountArray counts;
    uint drawCount;
    uint isPacked; // whether draws that are culled leave no gaps
    Sun sun;
    uint surfaceSampler;
    uint sky; // index into kTexturesCube
    uint skySampler;
    uint hasRelief; // whether normal maps count
};

layout(push_constant, scalar) uniform PushConstants { Frame frame; };

// The vertex at a corner of the triangles, counted through all of them.
uint vertexAt(uint corner) { return frame.scene.triangles.at[corner / 3u][corner % 3u]; }
uint materialAt(uint corner) { return frame.scene.triangleInfos.at[corner / 3u].material; }

vec3 sunClip(vec3 position) {
    vec4 p = vec4(position, 1.0);
    return vec3(dot(frame.sun.rows[0], p), dot(frame.sun.rows[1], p), dot(frame.sun.rows[2], p));
}

#endif
