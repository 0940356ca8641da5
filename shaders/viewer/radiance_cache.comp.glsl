// Adds what a frame has found to the means of the radiance cache, and frees entries that no path has updated for long. An invocation
// for each bucket, whose entries stay without gaps.
#include "viewer/radiance_cache_layout.glsl"

layout(local_size_x = 64) in;

// Frames that a mean remembers for the most part, and while something moves, whose light moves with it.
const float kMostFrames = 256.0;
const float kMostMovingFrames = 16.0;
const float kMostSamples = 4096.0;
// Samples that count in full until others take their place.
const float kKeptSamples = 4.0;
// Frames without an update before an entry is free.
const uint kMostIdleFrames = 64u;

// The mean with the samples of this frame. Those of the frames before count less each time, but not less than a few that a mean needs.
CacheCell updated(CacheCell cell, uvec4 sums) {
    float kept = 1.0 - 1.0 / (frame.sceneMoves != 0u ? kMostMovingFrames : kMostFrames);
    cell.samples = min(max(cell.samples * kept, min(cell.samples, kKeptSamples)), kMostSamples);
    if (sums.w == 0u) {
        cell.idle += 1u;
        return cell;
    }
    vec3 mean = vec3(sums.xyz) * (kSumUnit / (frame.exposure * float(sums.w)));
    cell.samples += float(sums.w);
    cell.mean = mix(cell.mean, mean, float(sums.w) / cell.samples);
    cell.idle = 0u;
    return cell;
}

void main() {
    uint bucket = gl_GlobalInvocationID.x;
    if (bucket >= frame.cacheBuckets) {
        return;
    }
    NumberArray keys = frame.cacheKeys;
    NumberArray sums = frame.cacheSums;
    uint first = bucket * kBucketEntries;
    uint to = first;
    uint from = first;
    for (; from < first + kBucketEntries && keys.at[from] != 0u; ++from) {
        uint word = from * kSumWords;
        uvec4 added = uvec4(sums.at[word], sums.at[word + 1u], sums.at[word + 2u], sums.at[word + 3u]);
        CacheCell cell = updated(frame.cacheCells.at[from], added);
        for (uint i = 0u; added.w != 0u && i < kSumWords; ++i) {
            sums.at[word + i] = 0u;
        }
        if (cell.idle <= kMostIdleFrames) {
            keys.at[to] = keys.at[from];
            frame.cacheCells.at[to] = cell;
            to += 1u;
        }
    }
    for (; to < from; ++to) {
        keys.at[to] = 0u;
        frame.cacheCells.at[to].samples = 0.0;
        frame.cacheCells.at[to].idle = 0u;
    }
}
