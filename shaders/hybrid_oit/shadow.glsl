// Sunlight at every pixel's opaque surface: what blocks and balls let through is nothing, what glass lets through is
// the product of all of its spheres. The including file provides traceSunlight().
#ifndef HYBRID_OIT_SHADOW
#define HYBRID_OIT_SHADOW

#include "common/ray_offset.glsl"
#include "hybrid_oit/gbuffer.glsl"
#include "hybrid_oit/sphere.glsl"

uint hashOf(uvec2 pixel) {
    uint state = pixel.x * 1664525u + pixel.y * 22695477u + 1013904223u;
    state = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (state >> 22u) ^ state;
}

// A place on the sun's disc: a spiral of equal areas, turned for each pixel. A single ray aims at its middle.
vec3 towardsSun(uint ray, float turn) {
    float radius = frame.shadowRays == 1u ? 0.0 : frame.sunRadius * sqrt((float(ray) + 0.5) / float(frame.shadowRays));
    float angle = 2.39996323 * float(ray) + turn;
    vec3 side = normalize(cross(frame.sunDirection, vec3(0.0, 0.0, 1.0)));
    vec3 other = cross(side, frame.sunDirection);
    return normalize(frame.sunDirection + radius * (cos(angle) * side + sin(angle) * other));
}

vec3 sunlightAt(vec3 position, vec3 normal, uint seed) {
    vec3 origin = leaveSurface(position, normal, frame.offsetExtent);
    float turn = float(seed & 0xffffu) / 65536.0 * 6.283185307;
    vec3 sum = vec3(0.0);
    for (uint ray = 0u; ray < frame.shadowRays; ray++) {
        vec3 direction = towardsSun(ray, turn);
        // Behind the horizon there is no light, and no ray that could meet the surface it starts from.
        if (dot(normal, direction) > 0.0) {
            sum += traceSunlight(origin, direction);
        }
    }
    return sum / float(frame.shadowRays);
}

void shadowPixel(uvec2 pixel) {
    Surface surface = surfaceAt(pixel);
    vec3 sunlight = vec3(0.0);
    if (surface.distance > 0.0 && dot(surface.normal, frame.sunDirection) > -frame.sunRadius) {
        sunlight = sunlightAt(surface.position, surface.normal, hashOf(pixel));
    }
    imageStore(kImages2D[frame.shadowImage], ivec2(pixel), vec4(sunlight, 1.0));
}

// Spheres of glass are lit as at the point nearest to the sun. From there rays leave the sphere, which is convex.
void shadowGlass(uint index) {
    Sphere sphere = frame.spheres.at[frame.ballCount + index];
    vec3 pole = sphere.center + sphere.radius * frame.sunDirection;
    frame.glassLight.at[index] = frame.sunColor * sunlightAt(pole, frame.sunDirection, 0u);
}

// The rows of the image, and one more for the spheres of glass.
void shadowAt(uvec2 launch) {
    if (launch.y < frame.camera.height) {
        shadowPixel(launch);
        return;
    }
    for (uint index = launch.x; index < frame.glassCount; index += frame.camera.width) {
        shadowGlass(index);
    }
}

#endif
