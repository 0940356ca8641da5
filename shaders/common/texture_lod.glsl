// Texture level of detail from ray cones (Akenine-Moeller et al., "Texture Level of Detail Strategies for
// Real-Time Ray Tracing"), the same for a rasterised and for a traced surface.
#ifndef COMMON_TEXTURE_LOD
#define COMMON_TEXTURE_LOD

// Beyond this the footprint's length no longer blurs a surface seen at a grazing angle.
const float kSmallestCosine = 0.05;

// `lodConstant`: half the log2 of a triangle's texel area over its area; `coneWidth`: the footprint's width
// across the ray; `cosine`: between the ray and the triangle's normal. The footprint is an ellipse on the
// surface, and the level is that of the square of the same area: between too sharp along and too soft across.
float coneTextureLod(float lodConstant, float coneWidth, float cosine) {
    return lodConstant + log2(max(coneWidth, 1e-30)) - 0.5 * log2(max(abs(cosine), kSmallestCosine));
}

#endif
