// The picture: light through some mist, exposed and encoded; or what the surfaces are like.
#include "deferred/targets.glsl"
#include "common/tonemap.glsl"

#ifdef ONE_PASS
LVK_INPUT(2, subpassInput, gLit);
layout(location = 3) out vec4 picture;
#else
layout(location = 0) out vec4 picture;
#endif

const uint kPicture = 0u;
const uint kAlbedo = 1u;
const uint kNormals = 2u;
const uint kRoughness = 3u;

vec3 developed(vec3 light, float depth) {
    float far = depth == 0.0 ? 0.0 : 1.0 - exp(-0.016 * frame.camera.nearPlane / depth);
    return encodeSrgb(expose(frame.exposure * mix(light, vec3(0.017, 0.023, 0.046), far)));
}

void main() {
    float depth = depthHere();
    vec3 color = developed(TARGET(gLit, lit).rgb, depth);
    if (frame.view != kPicture) {
        vec4 albedo = albedoAndRoughness();
        vec3 normal = normalAndMetalness().xyz;
        vec3 other = frame.view == kAlbedo      ? albedo.rgb
                     : frame.view == kNormals   ? 0.5 + 0.5 * normal
                     : frame.view == kRoughness ? albedo.aaa
                                                : vec3(pow(depth, 0.4));
        color = depth == 0.0 ? color : other;
    }
    picture = vec4(color, 1.0);
}
