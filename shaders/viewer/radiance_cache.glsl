// A cache of light in the world: a hash table over cells of space, after Binder et al. ("Massively Parallel Path Space Filtering",
// 2019). A cell has the light that its surfaces scatter, of sun, sky, lamps and all further surfaces, over their reflectance. It is as
// wide as a few pixels at its distance, and has one of 54 directions that its surfaces face.
//
// A frame reads means of the frames before alone. What it adds goes to sums of whole numbers, which do not depend on the order of
// additions; radiance_cache.comp.glsl adds them to the means when the frame's paths have ended.
#ifndef VIEWER_RADIANCE_CACHE
#define VIEWER_RADIANCE_CACHE

#include "viewer/path.glsl"
#include "viewer/radiance_cache_layout.glsl"

const uint kNoEntry = 0xffffffffu;
// The brightest sample, exposed.
const float kBrightestCached = 32.0;
// A path reads the cache where it is this wide at least, in sides of a cell: what is nearer would get the light of both sides of a corner.
const float kLeastWidth = 0.3;
// Cells do not get smaller nearer to the eye, in distances of the near plane.
const float kNearestCells = 50.0;
// A layer that mirrors less than this share, or is rougher, scatters about the same light to everywhere.
const float kMostMirrored = 0.25;
const float kLeastRoughness = 0.4;
// One path of a block of 4 x 4 pixels updates the cache.
const uint kBlock = 4u;

bool usesCache() {
    return frame.cacheBuckets != 0u;
}

// True if the path of a pixel is whole and updates the cache in this frame.
bool isUpdating(uint place) {
    uvec2 pixel = pixelOf(place);
    uvec2 block = pixel / kBlock;
    uint turn = frame.frameNumber * 7u + hashWords(block.x, block.y);
    return (pixel.y % kBlock) * kBlock + pixel.x % kBlock == turn % (kBlock * kBlock);
}

// The number of the block of a pixel, whose path that updates has a place in the list.
uint blockOf(uint place) {
    uvec2 block = pixelOf(place) / kBlock;
    return block.y * ((frame.camera.width + kBlock - 1u) / kBlock) + block.x;
}

float cellSide(vec3 position) {
    return frame.cellShare * max(length(position - frame.seen.eye), kNearestCells * frame.seen.nearPlane);
}

// True if a path that reaches a surface may end there with the light of the cache: what scatters about the same light to everywhere,
// seen through a cone that is wider than a cell.
bool isCached(Path path, Surface surface, Bsdf bsdf) {
    float through = bsdf.lobes[kThinLobe] + bsdf.lobes[kGlassLobe] + bsdf.lobes[kPaneLobe];
    bool isRough = surface.roughness >= kLeastRoughness && (surface.coat <= 0.0 || surface.coatRoughness >= kLeastRoughness);
    bool isMatte = bsdf.lobes[kCoatLobe] + bsdf.lobes[kSpecularLobe] <= kMostMirrored;
    return through <= 0.0 && (isRough || isMatte) && path.width >= kLeastWidth * cellSide(surface.position);
}

// A number of the direction that a surface faces: one of nine on each side of a cube.
uint facingOf(vec3 normal) {
    vec3 size = abs(normal);
    uint axis = size.x >= size.y && size.x >= size.z ? 0u : size.y >= size.z ? 1u : 2u;
    vec3 turned = axis == 0u ? normal.xyz : axis == 1u ? normal.yzx : normal.zxy;
    uvec2 place = uvec2(clamp(turned.yz / abs(turned.x) * 1.5 + 1.5, 0.0, 2.9));
    return ((axis * 2u + (turned.x < 0.0 ? 1u : 0u)) * 3u + place.x) * 3u + place.y;
}

struct CacheKey {
    uint bucket;
    uint checksum; // never 0, which is a free entry
};

// The cell at a surface. `random` moves it along the surface by half a side at most, and draws the level of its side, a power of two, so
// that borders of cells become gradients.
CacheKey cacheKey(Surface surface, uint random) {
    float level = floor(log2(cellSide(surface.position)) + unitFloat(hashWord(random + 2u)));
    float side = exp2(level);
    vec2 shift = vec2(unitFloat(random), unitFloat(hashWord(random + 1u))) - 0.5;
    mat3 basis = basisOf(surface.geometricNormal);
    // Floors and walls lie at round numbers more often than elsewhere: a part of a side in front of them is no border of cells.
    vec3 place = surface.position / side + basis * vec3(shift, 0.3);
    uvec3 cell = uvec3(ivec3(floor(place)));
    uint word = facingOf(surface.geometricNormal) + 64u * uint(int(level) + 512);
    uint bits = hashWords(cell.x, hashWords(cell.y, hashWords(cell.z, word)));
    // Another hash of the same numbers, so that cells which share a bucket differ.
    uint checksum = hashWords(cell.z ^ 0x68bc21ebu, hashWords(cell.x, hashWords(word, cell.y)));
    return CacheKey(bits % frame.cacheBuckets, max(checksum, 1u));
}

uint cacheRandom(Path path, Random random) {
    return hashWords(random.seed ^ 0x02e5be93u, hashWords(random.number, path.bounce));
}

// The mean light of a cell, and the number of its samples.
vec4 cachedLight(CacheKey key) {
    uint first = key.bucket * kBucketEntries;
    for (uint entry = first; entry < first + kBucketEntries; ++entry) {
        uint checksum = frame.cacheKeys.at[entry];
        if (checksum == key.checksum) {
            CacheCell cell = frame.cacheCells.at[entry];
            return vec4(cell.mean, cell.samples);
        }
        if (checksum == 0u) {
            break;
        }
    }
    return vec4(0.0);
}

// The entry of a cell, new if it has none; kNoEntry if all of its bucket have others.
uint cacheEntry(CacheKey key) {
    NumberArray keys = frame.cacheKeys;
    uint first = key.bucket * kBucketEntries;
    for (uint entry = first; entry < first + kBucketEntries; ++entry) {
        uint checksum = keys.at[entry];
        if (checksum == 0u) {
            checksum = atomicCompSwap(keys.at[entry], 0u, key.checksum);
            checksum = checksum == 0u ? key.checksum : checksum;
        }
        if (checksum == key.checksum) {
            return entry;
        }
    }
    return kNoEntry;
}

void beginUpdates(uint place) {
    frame.updatingPaths.at[blockOf(place)].count = 0u;
}

// Remembers a surface of a path until the path has ended.
void rememberUpdate(uint place, CacheKey key, Path path, vec3 reflectance) {
    uint block = blockOf(place);
    uint count = frame.updatingPaths.at[block].count;
    uint entry = count < kMostUpdates ? cacheEntry(key) : kNoEntry;
    if (entry != kNoEntry) {
        frame.updatingPaths.at[block].updates[count] = CacheUpdate(entry, path.radiance, path.throughput * reflectance);
        frame.updatingPaths.at[block].count = count + 1u;
    }
}

// Adds what a path that has ended found beyond each of its surfaces.
void addUpdates(uint place, Path path) {
    uint block = blockOf(place);
    uint count = frame.updatingPaths.at[block].count;
    vec3 found = radianceOf(path);
    for (uint number = 0u; number < count; ++number) {
        CacheUpdate update = frame.updatingPaths.at[block].updates[number];
        vec3 light = frame.exposure * (found - update.light) / max(update.factor, 1e-9);
        light = any(isnan(light)) ? vec3(0.0) : clamp(light, 0.0, kBrightestCached);
        // Rounded up as often as the rest says, so that faint light is not lost.
        float part = unitFloat(hashWords(place, hashWords(frame.frameNumber, number)));
        uvec3 whole = uvec3(light / kSumUnit + part);
        uint first = update.entry * kSumWords;
        atomicAdd(frame.cacheSums.at[first], whole.x);
        atomicAdd(frame.cacheSums.at[first + 1u], whole.y);
        atomicAdd(frame.cacheSums.at[first + 2u], whole.z);
        atomicAdd(frame.cacheSums.at[first + 3u], 1u);
    }
}

#endif
