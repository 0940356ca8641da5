// Geometry pass: what the ray pass needs to know about a pixel's surface. The interpolation is the traced one,
// from the triangle's vertices, so that both methods see the same surface point.
#include "hybrid/frame.glsl"
#include "common/octahedral.glsl"
#include "common/surface.glsl"

layout(location = 0) out vec4 outPosition; // w: distance from the eye
layout(location = 1) out uvec4 outSurface; // shading normal (two floats), geometric normal, triangle
layout(location = 2) out vec4 outAlbedo;

void main() {
    uint triangle = uint(gl_PrimitiveID);
    vec3 eye = frame.camera.eye;
    vec3 direction = cameraDirection(frame.camera, uvec2(gl_FragCoord.xy));
    vec2 b = barycentricsAlong(triangle, eye, direction);
    SurfacePoint point = surfaceAt(triangle, b, eye, direction, 0.0, frame.camera.pixelSpread, frame.surfaceSampler);
    outPosition = vec4(point.position, point.distance);
    // Mirrors magnify what is lost of the shading normal, so it keeps all its bits.
    uvec2 normal = floatBitsToUint(octahedralFromUnit(point.normal));
    uint geometricNormal = packSnorm2x16(octahedralFromUnit(point.geometricNormal));
    outSurface = uvec4(normal, geometricNormal, triangle);
    outAlbedo = vec4(point.albedo, 1.0);
}
