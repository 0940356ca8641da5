// The sky: radiance from a map of all directions, and directions drawn from it by their brightness.
#ifndef VIEWER_SKY
#define VIEWER_SKY

#include "viewer/frame.glsl"

vec2 skyPlace(vec3 direction) {
    return vec2(atan(direction.z, direction.x) / (2.0 * kPi) + 0.5, acos(clamp(direction.y, -1.0, 1.0)) / kPi);
}

vec3 skyRadiance(vec3 direction) {
    vec2 place = skyPlace(direction) * vec2(frame.skySize) - 0.5;
    vec2 low = floor(place);
    vec2 part = place - low;
    ivec2 size = ivec2(frame.skySize);
    ivec2 columns = (ivec2(low.x) + ivec2(0, 1) + size.x) % size.x;
    ivec2 rows = clamp(ivec2(low.y) + ivec2(0, 1), 0, size.y - 1) * size.x;
    vec3 upper = mix(frame.sky.at[rows.x + columns.x], frame.sky.at[rows.x + columns.y], part.x);
    vec3 lower = mix(frame.sky.at[rows.y + columns.x], frame.sky.at[rows.y + columns.y], part.x);
    return mix(upper, lower, part.y);
}

// Share of the row, or of the column of a row, in the distribution.
float skyShare(FloatArray cumulative, uint first, uint index) {
    return cumulative.at[first + index] - (index == 0u ? 0.0 : cumulative.at[first + index - 1u]);
}

float skyCellDensity(uvec2 cell, float sine) {
    FloatArray rows = frame.skyRows;
    FloatArray columns = frame.skyColumns;
    float share = skyShare(rows, 0u, cell.y) * skyShare(columns, cell.y * frame.skySize.x, cell.x);
    return share * float(frame.skySize.x * frame.skySize.y) / (2.0 * kPi * kPi * max(sine, 1e-6));
}

// Density of drawSky per solid angle.
float skyDensity(vec3 direction) {
    uvec2 cell = min(uvec2(skyPlace(direction) * vec2(frame.skySize)), frame.skySize - 1u);
    return skyCellDensity(cell, length(direction.xz));
}

// The first entry above `u`, and how far into it `u` is.
uint skySearch(FloatArray cumulative, uint first, uint count, float u, out float part) {
    uint low = 0u;
    uint high = count - 1u;
    while (low < high) {
        uint middle = (low + high) / 2u;
        if (u < cumulative.at[first + middle]) {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    float start = low == 0u ? 0.0 : cumulative.at[first + low - 1u];
    part = clamp((u - start) / max(cumulative.at[first + low] - start, 1e-20), 0.0, 0.999999);
    return low;
}

vec3 drawSky(vec2 u, out float density) {
    vec2 part;
    uvec2 cell;
    FloatArray rows = frame.skyRows;
    FloatArray columns = frame.skyColumns;
    cell.y = skySearch(rows, 0u, frame.skySize.y, u.y, part.y);
    cell.x = skySearch(columns, cell.y * frame.skySize.x, frame.skySize.x, u.x, part.x);
    vec2 place = (vec2(cell) + part) / vec2(frame.skySize);
    float around = 2.0 * kPi * (place.x - 0.5);
    float down = kPi * place.y;
    density = skyCellDensity(cell, sin(down));
    return vec3(sin(down) * cos(around), cos(down), sin(down) * sin(around));
}

#endif
