// The picture: opaque surfaces lit by sun and sky, seen through the sorted nodes of glass in front of them.
#include "common/tonemap.glsl"
#include "hybrid_oit/gbuffer.glsl"
#include "hybrid_oit/list.glsl"
#include "hybrid_oit/occlusion.glsl"
#include "hybrid_oit/sky.glsl"
#include "hybrid_oit/sphere.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Distance from the eye beyond which the floor fades into the horizon.
const float kHazeStart = 12.0;
const float kHazePerUnit = 0.045;

vec3 shade(Surface surface, vec3 direction, vec3 shadow) {
    float cosine = max(dot(surface.normal, frame.sunDirection), 0.0);
    vec3 sunlight = frame.sunColor * shadow;
    vec3 visible = skyVisibility(surface.position, surface.normal);
    vec3 color = surface.albedo * (cosine * sunlight + visible * skyAround(surface.normal));
    if (surface.gloss > 0.0) {
        vec3 mirrored = reflect(direction, surface.normal);
        float reflectance = glassReflectance(max(-dot(direction, surface.normal), 0.0));
        float highlight = pow(max(dot(mirrored, frame.sunDirection), 0.0), 350.0);
        vec3 mirror = visible * skyAlong(mirrored) + 30.0 * highlight * sunlight;
        color = mix(color, mirror, surface.gloss * reflectance);
    }
    float haze = 1.0 - exp(-kHazePerUnit * max(surface.distance - kHazeStart, 0.0));
    return mix(color, skyAlong(normalize(vec3(direction.x, 0.0, direction.z))), haze);
}

vec3 radianceAt(uvec2 pixel) {
    vec3 direction = cameraDirection(frame.camera, pixel);
    Surface surface = surfaceAt(pixel);
    vec3 background = skyAlong(direction);
    if (surface.distance > 0.0) {
        background = shade(surface, direction, textureBindlessFetch2D(frame.shadowTexture, ivec2(pixel), 0).rgb);
    }
    return throughNodes(frame.heads.at[headOf(pixel)], background);
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    uint side = frame.supersampling;
    if (any(greaterThanEqual(pixel * side, uvec2(frame.camera.width, frame.camera.height)))) {
        return;
    }
    // Exposed before the mean is taken, so that edges of bright things stay smooth.
    vec3 sum = vec3(0.0);
    for (uint i = 0u; i < side * side; i++) {
        sum += expose(radianceAt(pixel * side + uvec2(i % side, i / side)));
    }
    imageStore(kImages2D[frame.outputImage], ivec2(pixel), vec4(encodeSrgb(sum / float(side * side)), 1.0));
}
