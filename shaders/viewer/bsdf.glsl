// How a surface scatters light: the metallic-roughness model of glTF with its extensions, in layers that keep all light between
// them. A layer sends on its share (albedo.glsl) as seen from the view, and what lies below gets the rest. Metals and dielectrics
// without colour therefore neither lose nor gain light.
//
// Directions without further words point away from the surface and have unit length, in the world.
#ifndef VIEWER_BSDF
#define VIEWER_BSDF

#include "common/fresnel.glsl"
#include "viewer/random.glsl"
#include "viewer/thin.glsl"

// Ways to scatter that a direction is drawn from.
const uint kCoatLobe = 0u;
const uint kSpecularLobe = 1u;
const uint kDiffuseLobe = 2u; // and sheen
const uint kThinLobe = 3u; // through a thin surface
const uint kGlassLobe = 4u; // mirrored or bent at the boundary of a volume
const uint kPaneLobe = 5u; // straight on
const uint kLobeCount = 6u;

// A volume whose index of refraction differs less from that around it has a boundary that nothing shows.
const float kStraightEta = 5e-3;

struct Bsdf {
    mat3 basis; // of the normal, which is its third column
    mat3 coatBasis;
    vec3 view; // in the basis
    vec3 coatView;
    vec2 alpha;
    vec2 coatAlpha;
    float coat; // weights of the layers
    vec3 sheen;
    vec3 metal;
    vec3 metalF0;
    vec3 dielectric;
    vec3 f0;
    float f90;
    vec3 diffuse;
    vec3 thin;
    vec3 glass;
    vec3 glassTint;
    float eta; // index of refraction beyond the surface over that on the side of the view
    vec3 pane;
    float sheenRoughness;
    vec3 reflected; // the share of light that is neither matte nor sheen, about
    float lobes[kLobeCount]; // probability of each
};

// A direction that was drawn, with its density and the light that it brings: value times cosine over density.
struct Scattered {
    vec3 direction;
    vec3 weight; // 0 where the path ends
    vec3 matte; // the part of the weight by the matte layer and by sheen
    float density; // per solid angle, of all lobes together; unused for a pane
    bool isPane;
};

mat3 basisOf(vec3 n) {
    // Duff et al., "Building an Orthonormal Basis, Revisited", 2017.
    float side = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (side + n.z);
    float b = n.x * n.y * a;
    return mat3(vec3(1.0 + side * n.x * n.x * a, side * b, -side * n.x), vec3(b, side + n.y * n.y * a, -n.y), n);
}

// A basis whose first column is along `tangent`, or anywhere where that is 0.
mat3 basisAlong(vec3 n, vec3 tangent) {
    vec3 t = tangent - dot(tangent, n) * n;
    float length2 = dot(t, t);
    if (length2 < 1e-12) {
        return basisOf(n);
    }
    t *= inversesqrt(length2);
    return mat3(t, cross(n, t), n);
}

float largest(vec3 v) {
    return max(v.x, max(v.y, v.z));
}

// Weights of the layers below the coat.
void setLayers(inout Bsdf bsdf, Surface surface, float below, vec3 split) {
    float metalness = surface.metalness;
    vec3 f90 = vec3(surface.f90);
    float most = largest(surface.sheenColor);
    if (most > 0.0) {
        float share = splitAlbedo(bsdf.view.z, surface.sheenRoughness).z;
        bsdf.sheen = below * surface.sheenColor / max(share, 1.0);
        below *= 1.0 - min(most * min(share, 1.0), 1.0);
    }
    vec3 left = max(1.0 - reflectedShare(surface.f0, f90, split), 0.0);
    bool isVolume = surface.transmission > 0.0 && (surface.flags & kThin) == 0u;
    float glass = isVolume ? surface.transmission : 0.0;
    bsdf.metal = below * metalness * rescattering(surface.metalF0, split);
    bsdf.dielectric = below * (1.0 - metalness) * (1.0 - glass) * rescattering(surface.f0, split);
    // Where the boundary bends nothing, light goes straight on.
    bool isStraight = abs(bsdf.eta - 1.0) < kStraightEta;
    bsdf.glass = isStraight ? vec3(0.0) : vec3(below * (1.0 - metalness) * glass);
    vec3 matte = below * (1.0 - metalness) * left * surface.baseColor;
    bsdf.diffuse = matte * (1.0 - surface.transmission);
    if (isVolume && isStraight) {
        bsdf.pane = below * (1.0 - metalness) * glass * surface.baseColor;
    }
    if (surface.transmission > 0.0 && !isVolume) {
        bsdf.pane = isPane(surface) ? matte * surface.transmission : vec3(0.0);
        bsdf.thin = isPane(surface) ? vec3(0.0) : matte * surface.transmission / max(split.x, 1e-4);
    }
    vec3 metal = below * metalness * reflectedShare(surface.metalF0, vec3(1.0), split);
    vec3 dielectric = below * (1.0 - metalness) * (1.0 - glass) * reflectedShare(surface.f0, f90, split);
    bsdf.reflected = metal + dielectric + bsdf.lobes[kCoatLobe] + bsdf.glass + bsdf.pane + bsdf.thin * split.x;
    bsdf.lobes[kSpecularLobe] = largest(metal) + largest(dielectric);
    bsdf.lobes[kDiffuseLobe] = largest(bsdf.diffuse) + largest(bsdf.sheen);
    bsdf.lobes[kThinLobe] = largest(bsdf.thin) * split.x;
    bsdf.lobes[kGlassLobe] = largest(bsdf.glass);
    bsdf.lobes[kPaneLobe] = largest(bsdf.pane);
}

// `view`: where the ray came from.
Bsdf bsdfOf(Surface surface, vec3 view) {
    Bsdf bsdf;
    bsdf.basis = basisAlong(surface.normal, surface.tangent);
    bsdf.coatBasis = basisOf(surface.coatNormal);
    bsdf.view = view * bsdf.basis;
    bsdf.coatView = view * bsdf.coatBasis;
    bsdf.alpha = surface.alpha;
    bsdf.coatAlpha = vec2(alphaOf(surface.coatRoughness));
    bsdf.sheen = vec3(0.0);
    bsdf.thin = vec3(0.0);
    bsdf.pane = vec3(0.0);
    bsdf.metalF0 = surface.metalF0;
    bsdf.f0 = surface.f0;
    bsdf.f90 = surface.f90;
    bsdf.glassTint = surface.baseColor;
    bsdf.sheenRoughness = surface.sheenRoughness;
    float ior = max(surface.ior, 1.0);
    bsdf.eta = surface.isFront ? ior : 1.0 / ior;
    float below = belowCoat(surface, view);
    bsdf.coat = 0.0;
    if (surface.coat > 0.0) {
        vec3 coatSplit = splitAlbedo(bsdf.coatView.z, surface.coatRoughness);
        bsdf.coat = surface.coat * rescattering(vec3(kCoatF0), coatSplit).x;
    }
    bsdf.lobes[kCoatLobe] = 1.0 - below;
    setLayers(bsdf, surface, below, splitAlbedo(bsdf.view.z, surface.roughness));
    float sum = 0.0;
    for (uint i = 0u; i < kLobeCount; ++i) {
        sum += bsdf.lobes[i];
    }
    for (uint i = 0u; i < kLobeCount; ++i) {
        bsdf.lobes[i] /= max(sum, 1e-20);
    }
    return bsdf;
}

// The light that a surface scatters over all light that falls on it evenly.
vec3 reflectanceOf(Bsdf bsdf) {
    return max(bsdf.diffuse + bsdf.sheen + bsdf.reflected, 1e-3);
}

// A direction above the plane of x and y, as likely as its cosine.
vec3 cosineDirection(vec2 u) {
    float angle = 2.0 * kPi * u.y;
    return vec3(sqrt(u.x) * vec2(cos(angle), sin(angle)), sqrt(1.0 - u.x));
}

// The light of a direction, cosine included, and the density with which it is drawn.
struct Response {
    vec3 value;
    vec3 matte; // the part of the value by the matte layer and by sheen
    float density;
};

float sheenDistribution(float cosine, float roughness) {
    // Estevez and Kulla, "Production Friendly Microfacet Sheen BRDF", 2017.
    float inverse = 1.0 / max(roughness * roughness, 1e-3);
    return (2.0 + inverse) * pow(max(1.0 - cosine * cosine, 1e-7), 0.5 * inverse) / (2.0 * kPi);
}

void addCoat(inout Response all, Bsdf bsdf, vec3 toLight) {
    vec3 l = toLight * bsdf.coatBasis;
    if (bsdf.lobes[kCoatLobe] <= 0.0 || l.z <= 0.0) {
        return;
    }
    vec3 h = normalize(bsdf.coatView + l);
    float d = ggxDistribution(h, bsdf.coatAlpha) / (4.0 * bsdf.coatView.z);
    float fresnel = kCoatF0 + (1.0 - kCoatF0) * schlickWeight(dot(bsdf.coatView, h));
    all.value += bsdf.coat * fresnel * d * smithTwo(bsdf.coatView, l, bsdf.coatAlpha);
    all.density += bsdf.lobes[kCoatLobe] * d * smithOne(bsdf.coatView, bsdf.coatAlpha);
}

void addReflection(inout Response all, Bsdf bsdf, vec3 l) {
    vec3 h = normalize(bsdf.view + l);
    float cosine = dot(bsdf.view, h);
    float d = ggxDistribution(h, bsdf.alpha) / (4.0 * bsdf.view.z);
    float shadowed = d * smithTwo(bsdf.view, l, bsdf.alpha);
    float seen = d * smithOne(bsdf.view, bsdf.alpha);
    float weight = schlickWeight(cosine);
    all.value += shadowed * bsdf.metal * mix(bsdf.metalF0, vec3(1.0), weight);
    all.value += shadowed * bsdf.dielectric * mix(bsdf.f0, vec3(bsdf.f90), weight);
    all.density += bsdf.lobes[kSpecularLobe] * seen;
    if (bsdf.lobes[kGlassLobe] > 0.0) {
        float fresnel = fresnelDielectric(cosine, 1.0 / bsdf.eta);
        all.value += fresnel * shadowed * bsdf.glass;
        all.density += bsdf.lobes[kGlassLobe] * fresnel * seen;
    }
    all.matte = bsdf.diffuse * (l.z / kPi);
    if (largest(bsdf.sheen) > 0.0) {
        float visible = 1.0 / (4.0 * max(l.z + bsdf.view.z - l.z * bsdf.view.z, 1e-4));
        all.matte += bsdf.sheen * sheenDistribution(h.z, bsdf.sheenRoughness) * visible * l.z;
    }
    all.value += all.matte;
    all.density += bsdf.lobes[kDiffuseLobe] * l.z / kPi;
}

void addTransmission(inout Response all, Bsdf bsdf, vec3 l) {
    if (bsdf.lobes[kThinLobe] > 0.0) {
        vec3 mirrored = vec3(l.xy, -l.z);
        float d = ggxDistribution(normalize(bsdf.view + mirrored), bsdf.alpha) / (4.0 * bsdf.view.z);
        all.value += bsdf.thin * d * smithTwo(bsdf.view, mirrored, bsdf.alpha);
        all.density += bsdf.lobes[kThinLobe] * d * smithOne(bsdf.view, bsdf.alpha);
    }
    vec3 sum = bsdf.view + bsdf.eta * l;
    float length2 = dot(sum, sum);
    if (bsdf.lobes[kGlassLobe] <= 0.0 || length2 < 1e-12) {
        return;
    }
    // Walter et al., "Microfacet Models for Refraction through Rough Surfaces", 2007.
    vec3 h = sum * inversesqrt(length2);
    h = h.z < 0.0 ? -h : h;
    float viewCosine = dot(bsdf.view, h);
    float lightCosine = dot(l, h);
    if (viewCosine <= 0.0 || lightCosine >= 0.0) {
        return;
    }
    float bent = viewCosine + bsdf.eta * lightCosine;
    float d = ggxDistribution(h, bsdf.alpha) * viewCosine / bsdf.view.z * bsdf.eta * bsdf.eta * -lightCosine / max(bent * bent, 1e-12);
    float through = 1.0 - fresnelDielectric(viewCosine, 1.0 / bsdf.eta);
    float seen = smithOne(bsdf.view, bsdf.alpha);
    float shadowed = seen * smithOne(vec3(l.xy, -l.z), bsdf.alpha);
    all.value += bsdf.glass * bsdf.glassTint * through * d * shadowed / (bsdf.eta * bsdf.eta);
    all.density += bsdf.lobes[kGlassLobe] * through * d * seen;
}

// All lobes but the pane.
Response respond(Surface surface, Bsdf bsdf, vec3 toLight) {
    Response all = Response(vec3(0.0), vec3(0.0), 0.0);
    vec3 l = toLight * bsdf.basis;
    bool isAbove = dot(toLight, surface.geometricNormal) > 0.0;
    if (isAbove) {
        addCoat(all, bsdf, toLight);
    }
    if (isAbove && l.z > 0.0) {
        addReflection(all, bsdf, l);
    }
    if (!isAbove && l.z < 0.0) {
        addTransmission(all, bsdf, l);
    }
    return all;
}

// A direction, and whether it leaves the side of the surface that its lobe scatters to. A microfacet may send light to the other
// side, where it meets further microfacets: that light is lost, or is in the share of rescattering().
struct Drawn {
    vec3 direction;
    bool isKept;
};

Drawn drawGlass(Bsdf bsdf, vec2 u, float choice) {
    vec3 h = visibleNormal(bsdf.view, bsdf.alpha, u);
    bool isMirrored = choice < fresnelDielectric(dot(bsdf.view, h), 1.0 / bsdf.eta);
    vec3 l = isMirrored ? reflect(-bsdf.view, h) : refract(-bsdf.view, h, 1.0 / bsdf.eta);
    return Drawn(bsdf.basis * l, isMirrored ? l.z > 0.0 : l.z < 0.0);
}

Drawn drawDirection(Bsdf bsdf, uint lobe, vec2 u, float choice) {
    if (lobe == kCoatLobe) {
        vec3 mirrored = reflect(-bsdf.coatView, visibleNormal(bsdf.coatView, bsdf.coatAlpha, u));
        return Drawn(bsdf.coatBasis * mirrored, mirrored.z > 0.0);
    }
    if (lobe == kDiffuseLobe) {
        return Drawn(bsdf.basis * cosineDirection(u), true);
    }
    if (lobe == kGlassLobe) {
        return drawGlass(bsdf, u, choice);
    }
    vec3 mirrored = reflect(-bsdf.view, visibleNormal(bsdf.view, bsdf.alpha, u));
    vec3 l = lobe == kThinLobe ? vec3(mirrored.xy, -mirrored.z) : mirrored;
    return Drawn(bsdf.basis * l, mirrored.z > 0.0);
}

// `view`: where the ray came from.
Scattered scatter(Surface surface, Bsdf bsdf, vec3 view, vec2 choices, vec2 u) {
    uint lobe = 0u;
    float before = 0.0;
    while (lobe + 1u < kLobeCount && choices.x >= before + bsdf.lobes[lobe]) {
        before += bsdf.lobes[lobe];
        lobe += 1u;
    }
    if (lobe == kPaneLobe) {
        float chance = bsdf.lobes[kPaneLobe];
        return Scattered(-view, chance > 0.0 ? bsdf.pane / chance : vec3(0.0), vec3(0.0), 0.0, true);
    }
    Drawn drawn = drawDirection(bsdf, lobe, u, choices.y);
    Response response = respond(surface, bsdf, drawn.direction);
    float inverse = drawn.isKept && response.density > 0.0 ? 1.0 / response.density : 0.0;
    return Scattered(drawn.direction, response.value * inverse, response.matte * inverse, response.density, false);
}

#endif
