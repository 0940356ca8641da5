// Lights a pass's pixels, adds them to the cache, and shows its average.
#include "rtx_ao/frame.glsl"
#include "common/tonemap.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

vec3 skyRadiance(vec3 direction) {
    return mix(vec3(0.62, 0.67, 0.72), vec3(0.22, 0.36, 0.58), sqrt(max(direction.y, 0.0)));
}

// Radiance and openness.
vec4 seenAt(uvec2 pixel) {
    vec4 light = textureBindlessFetch2D(frame.light, ivec2(pixel), 0);
    if (light.a == 0.0) {
        return vec4(skyRadiance(cameraDirection(frame.camera, pixel)), 1.0);
    }
    vec3 albedo = textureBindlessFetch2D(frame.albedo, ivec2(pixel), 0).rgb;
    vec3 ambient = mix(frame.ambientBelow, frame.ambientAbove, light.z);
    return vec4(albedo * (light.x * frame.sunColor + light.y * ambient), light.y);
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (pixel.x >= frame.camera.width || pixel.y >= frame.camera.height) {
        return;
    }
    uint place = pixel.y * frame.camera.width + pixel.x;
    vec4 sum = seenAt(pixel);
    if (frame.pass > 0u) {
        sum += frame.sums.at[place];
    }
    frame.sums.at[place] = sum;
    vec3 color = encodeSrgb(expose(sum.rgb / float(frame.pass + 1u)));
    imageStore(kImages2D[frame.image], ivec2(pixel), vec4(color, 1.0));
}
