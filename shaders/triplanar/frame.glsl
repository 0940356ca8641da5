// The frame constants of the sample.
#ifndef TRIPLANAR_FRAME
#define TRIPLANAR_FRAME

#include "common/camera.glsl"
#include "common/vertices.glsl"

// Something that is shown: one of the models at its place.
struct Body {
    vec3 place;
    float size;
    float turn; // about the upright axis, in rounds
    float radius; // of a ball that shades others as the body does; 0 for none
    uint sides; // numbers of textures
    uint top;
};

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Bodies { Body at[]; };

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Frame {
    Camera camera;
    VertexArray vertices;
    Bodies bodies;
    uint textures[7]; // of each number, the placeholder's where it is not there
    uint smp;
    uint bodyCount;
    float phase; // of the animation's round, 0 to 1
    float sharpness; // how soon one plane takes over from another
    uint byAngles; // 1 for textures by longitude and latitude, for comparison
};

layout(push_constant, scalar) uniform Push { Frame frame; };

const vec3 kBackdrop = vec3(0.78, 0.80, 0.82);

// About the upright axis.
vec3 turned(Body body, vec3 direction) {
    float angle = 6.2831853 * body.turn * frame.phase;
    return vec3(cos(angle) * direction.x + sin(angle) * direction.z, direction.y, cos(angle) * direction.z - sin(angle) * direction.x);
}

#endif
