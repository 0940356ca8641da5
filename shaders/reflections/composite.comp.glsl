// Lit opaque surfaces: straight light, ambient light as far as the surroundings are open, and the reflection.
#include "reflections/ambient.glsl"
#include "reflections/gbuffer.glsl"
#include "reflections/lights.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Light of lamps and sun, as far as the pixel sees them.
vec3 directLight(Surface surface, vec3 view, float distance, vec3 visibility) {
    vec3 color = vec3(0.0);
    vec3 origin = surface.position + surface.geometricNormal * liftAt(distance);
    for (uint i = 0u; i < frame.lightCount; ++i) {
        color += visibility[i] * leaving(surface, view, lightAt(origin, frame.lights[i], vec2(0.0)));
    }
    return color;
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
        vec4 visibility = textureBindlessFetch2D(frame.visibility, pixel, 0);
        float open = visibility.a;
        vec3 diffuse = surface.albedo * (1.0 - surface.metalness) * ambientIrradiance(surface.normal) * open;
        // Surfaces too rough for rays reflect the ambient light, occluded by the surroundings as diffuse light is.
        vec4 reflection = textureBindlessFetch2D(frame.reflection, pixel, 0);
        vec3 mirrored = reflection.rgb * (reflection.a > 0.0 ? 1.0 : open);
        vec3 share = environmentReflectance(surface, max(-dot(direction, surface.normal), 0.0));
        vec3 direct = directLight(surface, -direction, distance, visibility.rgb);
        color = hazed(surface.emission + direct + diffuse + share * mirrored, direction, distance);
    }
    imageStore(kImages2D[frame.composite], pixel, vec4(color, 1.0));
}
