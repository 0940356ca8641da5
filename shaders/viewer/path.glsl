// The light of a pixel by paths from the camera. At each surface a shadow ray looks for light, and the path goes on in a direction
// that the surface prefers; light that both can find is shared between them. The including file provides traceNearest() and
// transmittanceTo().
#ifndef VIEWER_PATH
#define VIEWER_PATH

#include "common/ray_offset.glsl"
#include "viewer/lights.glsl"

// Surfaces of a path before chance may end it.
const uint kSureBounces = 3u;

vec3 leaveTo(Surface surface, vec3 direction) {
    bool isAbove = dot(direction, surface.geometricNormal) > 0.0;
    return leaveSurface(surface.position, isAbove ? surface.geometricNormal : -surface.geometricNormal, frame.offsetExtent);
}

vec3 directLight(Surface surface, Bsdf bsdf, vec2 choices, vec2 u) {
    Arriving arriving = drawLight(surface.position, choices.x, u);
    Response response = respond(surface, bsdf, arriving.direction);
    if (!any(greaterThan(response.value * arriving.radiance, vec3(0.0)))) {
        return vec3(0.0);
    }
    vec3 origin = leaveTo(surface, arriving.direction);
    float range = arriving.distance >= kFar ? kFar : 0.9999 * arriving.distance;
    vec3 way = transmittanceTo(origin, arriving.direction, range);
    float share = arriving.density > 0.0 ? powerShare(arriving.density, response.density) : 1.0;
    return share * way * response.value * arriving.radiance;
}

vec3 pathRadiance(vec3 origin, vec3 direction, inout Random random) {
    vec3 radiance = vec3(0.0);
    vec3 throughput = vec3(1.0);
    vec3 extinction = vec3(0.0); // of the volume that the path is in
    float squeezed = 1.0; // radiance is eta^2 as much inside of a volume, which comes back at its end
    float density = -1.0;
    for (uint bounce = 0u; bounce <= frame.maxBounces; ++bounce) {
        Hit hit = traceNearest(origin, direction, hashWords(random.seed + bounce, random.number));
        if (hit.instance == kNothing) {
            radiance += throughput * missedLight(direction, density);
            break;
        }
        Surface surface = surfaceAt(hit, direction, 0.0);
        throughput *= exp(-extinction * hit.distance);
        if ((surface.flags & kUnlit) != 0u) {
            radiance += throughput * surface.baseColor;
            break;
        }
        radiance += throughput * surface.emission;
        Bsdf bsdf = bsdfOf(surface, -direction);
        vec2 lightChoices = nextPair(random);
        vec2 lightPlace = nextPair(random);
        radiance += throughput * directLight(surface, bsdf, lightChoices, lightPlace);
        vec2 choices = nextPair(random);
        vec2 u = nextPair(random);
        Scattered scattered = scatter(surface, bsdf, -direction, choices, u);
        throughput *= scattered.weight;
        bool isInside = dot(scattered.direction, surface.geometricNormal) < 0.0;
        if (isInside && (surface.flags & kThin) == 0u) {
            extinction = surface.isFront ? frame.materials.at[surface.material].extinction : vec3(0.0);
            squeezed *= bsdf.eta * bsdf.eta;
        }
        density = scattered.isPane ? density : scattered.density;
        origin = leaveTo(surface, scattered.direction);
        direction = scattered.direction;
        float chance = min(largest(throughput) * squeezed, 1.0);
        if (bounce >= kSureBounces) {
            chance = min(chance, 0.95);
            if (lightChoices.y >= chance) {
                break;
            }
            throughput /= chance;
        } else if (chance <= 0.0) {
            break;
        }
    }
    return radiance;
}

// Samples of a pixel are spread over all of it.
vec3 sampleRadiance(uvec2 pixel, uint number) {
    Random random = randomOf(pixel, number);
    vec2 ndc = (vec2(pixel) + nextPair(random)) / vec2(frame.camera.width, frame.camera.height) * 2.0 - 1.0;
    vec3 direction = normalize(frame.camera.forward + ndc.x * frame.camera.right + ndc.y * frame.camera.down);
    vec3 radiance = pathRadiance(frame.camera.eye, direction, random);
    bool isNumber = !any(isnan(radiance)) && !any(isinf(radiance));
    return isNumber ? radiance : vec3(0.0);
}

void pathPixel(uvec2 pixel) {
    uint place = pixel.y * frame.camera.width + pixel.x;
    vec3 sum = frame.sampleNumber == 0u ? vec3(0.0) : frame.sums.at[place].rgb;
    for (uint i = 0u; i < frame.sampleCount; ++i) {
        sum += sampleRadiance(pixel, frame.sampleNumber + i);
    }
    frame.sums.at[place] = vec4(sum, 1.0);
}

#endif
