// Random numbers: Sobol's first two dimensions for each pair of numbers, with an order and a scrambling of its own (Burley,
// "Practical Hash-based Owen Scrambling", 2020). Any number of samples is spread evenly; the mean of each is exact.
#ifndef VIEWER_RANDOM
#define VIEWER_RANDOM

// A good mix of the bits of a word (Wellons, "Prospecting for Hash Functions", `lowbias32`).
uint hashWord(uint x) {
    x = (x ^ (x >> 16)) * 0x7feb352du;
    x = (x ^ (x >> 15)) * 0x846ca68bu;
    return x ^ (x >> 16);
}

uint hashWords(uint a, uint b) {
    return hashWord(a ^ hashWord(b + 0x9e3779b9u));
}

// The numbers of one sample of a pixel.
struct Random {
    uint seed; // of the pixel
    uint number; // of the sample
    uint pair; // numbers drawn so far, in pairs
};

// Changes a bit according to a hash of all bits below it (Laine and Karras, 2011, with Burley's constants).
uint scrambleUpwards(uint x, uint seed) {
    x += seed;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return x;
}

uint scrambleOwen(uint x, uint seed) {
    return bitfieldReverse(scrambleUpwards(bitfieldReverse(x), seed));
}

// The second dimension of Sobol's sequence; the first is the bits in reverse.
uint sobolSecond(uint number) {
    uint column = 0x80000000u;
    uint value = 0u;
    for (; number != 0u; number >>= 1) {
        value ^= (number & 1u) != 0u ? column : 0u;
        column ^= column >> 1;
    }
    return value;
}

float unitFloat(uint bits) {
    return float(bits >> 8) * (1.0 / 16777216.0);
}

Random randomOf(uvec2 pixel, uint number) {
    return Random(hashWords(pixel.x, pixel.y), number, 0u);
}

// Two numbers from 0 to below 1.
vec2 nextPair(inout Random random) {
    uint seed = hashWords(random.seed, random.pair);
    random.pair += 1u;
    uint number = scrambleOwen(random.number, seed);
    uint first = scrambleOwen(bitfieldReverse(number), hashWords(seed, 1u));
    uint second = scrambleOwen(sobolSecond(number), hashWords(seed, 2u));
    return vec2(unitFloat(first), unitFloat(second));
}

#endif
