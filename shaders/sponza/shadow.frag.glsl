// Holes cast no shadow.
#include "sponza/mask.glsl"

layout(location = 0) in vec2 inTexcoord;
layout(location = 1) flat in uint inMaterial;

void main() {
    if (isHole(inMaterial, texelOf(inMaterial, inTexcoord).a)) {
        discard;
    }
}
