// Lit opaque surfaces: straight light, ambient light as far as the surroundings are open, and the reflection.
#include "reflections/ambient.glsl"
#include "reflections/gbuffer.glsl"
#include "reflections/reflectance.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Openness of the pixel and its neighbours on the same surface: each of them asked one ray.
float smoothOpenness(ivec2 pixel, ivec2 last, Surface surface, float distance) {
    float sum = 0.0;
    float total = 0.0;
    for (int i = 0; i < 25; ++i) {
        ivec2 at = clamp(pixel + ivec2(i % 5 - 2, i / 5 - 2), ivec2(0), last);
        vec3 direction = cameraDirection(frame.camera, uvec2(at));
        float depth = textureBindlessFetch2D(frame.opaqueDepth, at, 0).r;
        vec3 position = frame.camera.eye + direction * depthDistance(max(depth, 1e-6), direction);
        vec3 normal = packedNormal(textureBindlessFetchU2D(frame.opaqueSurface, at, 0));
        float offPlane = abs(dot(surface.normal, position - surface.position)) / (0.01 * distance);
        float weight = at == pixel ? 1.0 : pow(max(dot(normal, surface.normal), 0.0), 16.0) * exp(-offPlane);
        sum += weight * textureBindlessFetch2D(frame.direct, at, 0).a;
        total += weight;
    }
    return sum / total;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 last = ivec2(frame.camera.width, frame.camera.height) - 1;
    if (any(greaterThan(pixel, last))) {
        return;
    }
    vec3 direction = cameraDirection(frame.camera, uvec2(pixel));
    Surface surface;
    float distance;
    vec3 color = skyRadiance(direction);
    if (readSurface(frame.opaqueDepth, frame.opaqueSurface, uvec2(pixel), direction, surface, distance)) {
        float open = smoothOpenness(pixel, last, surface, distance);
        vec3 diffuse = surface.albedo * (1.0 - surface.metalness) * ambientIrradiance(surface.normal) * open;
        // What is too rough to be traced sees the ambient light, which the surroundings hide as they do for diffuse.
        vec4 reflection = textureBindlessFetch2D(frame.reflection, pixel, 0);
        vec3 mirrored = reflection.rgb * (reflection.a > 0.0 ? 1.0 : open);
        vec3 share = environmentReflectance(surface, max(-dot(direction, surface.normal), 0.0));
        color = surface.emission + textureBindlessFetch2D(frame.direct, pixel, 0).rgb + diffuse + share * mirrored;
    }
    imageStore(kImages2D[frame.composite], pixel, vec4(color, 1.0));
}
