// Colours of thin films: light that a film's two sides reflect interferes (Belcour and Barla, "A Practical Extension to Microfacet
// Theory for the Modeling of Varying Iridescence", 2017, in the form that KHR_materials_iridescence gives it).
#ifndef VIEWER_IRIDESCENCE
#define VIEWER_IRIDESCENCE

#include "viewer/ggx.glsl"

// Below this thickness in nanometres a film fades away.
const float kThinnestFilm = 30.0;

// The response of the eye to interference by an optical path difference in nanometres, with a shift of the phase, as red, green and
// blue of sRGB's primaries: Gaussians for the three curves, transformed by Fourier.
vec3 eyeResponse(float pathDifference, vec3 shift) {
    float phase = 2.0 * kPi * pathDifference * 1e-9;
    const vec3 height = vec3(5.4856e-13, 4.4201e-13, 5.2481e-13);
    const vec3 place = vec3(1.6810e+06, 1.7953e+06, 2.2084e+06);
    const vec3 variance = vec3(4.3278e+09, 9.3046e+09, 6.6121e+09);
    vec3 xyz = height * sqrt(2.0 * kPi * variance) * cos(place * phase + shift) * exp(-phase * phase * variance);
    // The curve of x has a second peak.
    xyz.x += 9.7470e-14 * sqrt(2.0 * kPi * 4.5282e+09) * cos(2.2399e+06 * phase + shift.x) * exp(-4.5282e+09 * phase * phase);
    xyz /= 1.0685e-7;
    const mat3 toRgb = mat3(3.2404542, -0.9692660, 0.0556434, -1.5371385, 1.8760108, -0.2040259, -0.4985314, 0.0415560, 1.0572252);
    return toRgb * xyz;
}

vec3 squared(vec3 v) {
    return v * v;
}

// The reflectance of a base of reflectance `f0` straight on, below a film, as seen from an angle with this cosine.
vec3 filmReflectance(vec3 f0, float ior, float thickness, float cosine) {
    float film = mix(1.0, ior, smoothstep(0.0, kThinnestFilm, thickness));
    float sine2 = (1.0 - cosine * cosine) / (film * film);
    if (sine2 >= 1.0) {
        return vec3(1.0);
    }
    float inside = sqrt(1.0 - sine2); // cosine of the angle inside of the film
    float straight = (film - 1.0) / (film + 1.0);
    float top = mix(straight * straight, 1.0, schlickWeight(cosine));
    vec3 root = sqrt(clamp(f0, 0.0, 0.9999));
    vec3 baseIor = (1.0 + root) / (1.0 - root);
    vec3 bottom = mix(squared((baseIor - film) / (baseIor + film)), vec3(1.0), schlickWeight(inside));
    // A reflection at what is denser turns the phase by half: inside of the film at its top, and at its bottom.
    vec3 shift = (film < 1.0 ? kPi : 0.0) + mix(vec3(0.0), vec3(kPi), greaterThan(baseIor, vec3(film)));
    float pathDifference = 2.0 * film * thickness * inside;
    float through = 1.0 - top;
    vec3 both = clamp(top * bottom, 1e-5, 0.9999);
    vec3 all = through * through * bottom / (1.0 - both);
    vec3 light = top + all;
    vec3 amplitude = all - through;
    for (int order = 1; order <= 2; ++order) {
        amplitude *= sqrt(both);
        light += amplitude * 2.0 * eyeResponse(float(order) * pathDifference, float(order) * shift);
    }
    return clamp(light, 0.0, 1.0);
}

// The reflectance straight on whose Schlick term is that of the film at this cosine.
vec3 filmF0(vec3 f0, float ior, float thickness, float cosine) {
    float weight = min(schlickWeight(cosine), 0.99);
    return clamp((filmReflectance(f0, ior, thickness, cosine) - weight) / (1.0 - weight), 0.0, 1.0);
}

#endif
