// Floor and blocks into the G-buffer.
#include "hybrid_oit/gbuffer.glsl"

layout(location = 0) in vec3 inPosition;
layout(location = 1) flat in uint inFace;
layout(location = 0) out vec4 outPosition; // w: distance from the eye
layout(location = 1) out uvec4 outSurface;

void main() {
    Face face = frame.faces.at[inFace];
    outPosition = vec4(inPosition, distance(inPosition, frame.camera.eye));
    outSurface = packSurface(face.normal, face.albedo, 0.0);
}
