// The sizes of the radiance cache, and of its sums.
#ifndef VIEWER_RADIANCE_CACHE_LAYOUT
#define VIEWER_RADIANCE_CACHE_LAYOUT

#include "viewer/frame.glsl"

// Neighbouring entries that a cell may have. The first that is free ends a search.
const uint kBucketEntries = 16u;
// Words of the sums of an entry: three colours and the number of samples.
const uint kSumWords = 4u;
// The unit of sums, of exposed light.
const float kSumUnit = 1.0 / 256.0;

#endif
