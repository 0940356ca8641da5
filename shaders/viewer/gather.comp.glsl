// Light of a pixel, by ray queries.
#include "common/group_pixel.glsl"
#include "viewer/trace_query.glsl"
#include "viewer/gather.glsl"

#define PIXEL_FUNCTION gatherPixel
#include "common/for_each_pixel.glsl"
