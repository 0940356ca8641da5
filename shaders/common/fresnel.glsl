// Reflectance of a boundary (Fresnel).
#ifndef COMMON_FRESNEL
#define COMMON_FRESNEL

// Unpolarised reflectance of a dielectric. `eta`: index of refraction on the ray's side over the one beyond.
// 1 where everything is reflected.
float fresnelDielectric(float cosine, float eta) {
    float squaredSine = eta * eta * (1.0 - cosine * cosine);
    if (squaredSine >= 1.0) {
        return 1.0;
    }
    float beyond = sqrt(1.0 - squaredSine);
    float perpendicular = (eta * cosine - beyond) / (eta * cosine + beyond);
    float parallel = (cosine - eta * beyond) / (cosine + eta * beyond);
    return 0.5 * (perpendicular * perpendicular + parallel * parallel);
}

#endif
