// Writes the instances: the ground, and crates and rings in rows that rise and fall like waves. What an instance shows
// is in its custom index: the number of its texture, and above 16 bits that of its model.
#include "rtx_textures/frame.glsl"

layout(local_size_x = 64) in;

const uint kColumns = 13u;
const float kTurn = 6.2831853;

// `place` in grid steps from the middle. Turned by a whole number of turns in a round, up and down twice.
void placeThing(uint number, vec2 place, uint model, uint tex) {
    float wave = kTurn * (2.0 * frame.phase + 0.11 * place.x - 0.07 * place.y);
    float angle = kTurn * ((number % 2u == 0u ? 1.0 : -1.0) * frame.phase + fract(0.61 * float(number)));
    vec3 to = vec3(1.25 * place.x, 0.62 + 0.3 * sin(wave), 1.25 * place.y);
    float size = model == kCrate ? 0.62 : 1.0;
    float c = size * cos(angle);
    float s = size * sin(angle);
    frame.records.at[number].rows[0] = vec4(c, 0.0, s, to.x);
    frame.records.at[number].rows[1] = vec4(0.0, size, 0.0, to.y);
    frame.records.at[number].rows[2] = vec4(-s, 0.0, c, to.z);
    frame.records.at[number].customIndexAndMask = model << 16 | tex | 0xffu << 24;
    frame.records.at[number].hitGroupAndFlags = model == kRing ? kGlazed : kPainted;
    frame.records.at[number].model = model;
    frame.records.at[number].modelHigh = 0u;
}

void placeGround() {
    frame.records.at[0].rows[0] = vec4(1.0, 0.0, 0.0, 0.0);
    frame.records.at[0].rows[1] = vec4(0.0, 1.0, 0.0, 0.0);
    frame.records.at[0].rows[2] = vec4(0.0, 0.0, 1.0, 0.0);
    frame.records.at[0].customIndexAndMask = kGround << 16 | frame.textures[0] | 0xffu << 24;
    frame.records.at[0].hitGroupAndFlags = kPainted;
    frame.records.at[0].model = kGround;
    frame.records.at[0].modelHigh = 0u;
}

void main() {
    uint number = gl_GlobalInvocationID.x;
    if (number >= frame.count) {
        return;
    }
    if (number == 0u) {
        placeGround();
        return;
    }
    uint cell = number - 1u;
    vec2 place = vec2(cell % kColumns, cell / kColumns) - vec2(kColumns / 2u);
    bool isCrate = (cell % kColumns + cell / kColumns) % 2u == 0u;
    placeThing(number, place, isCrate ? kCrate : kRing, frame.textures[(cell * 5u + cell / 7u) % 6u]);
}
