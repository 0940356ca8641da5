// The range of reflected rays. A rough surface blurs distant geometry beyond recognition, so its rays may end early:
// `reflections::range` in Rust has the same rule and says why.
#ifndef REFLECTIONS_RANGE
#define REFLECTIONS_RANGE

const float kFar = 200.0; // scene units; beyond the scene
const float kBlurredExtent = 2.5; // scene units; what the lobe is wide at the end of a ray
const float kMirrorRoughness = 0.08; // below, rays go all the way
const float kRoughestTraced = 0.7; // from here on no ray is traced at all

float lobeTangent(float roughness) {
    return roughness * roughness;
}

float reflectionRange(float roughness) {
    if (roughness < kMirrorRoughness) {
        return kFar;
    }
    return roughness < kRoughestTraced ? min(kBlurredExtent / lobeTangent(roughness), kFar) : 0.0;
}

#endif
