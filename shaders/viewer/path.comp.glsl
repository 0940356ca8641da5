// Paths of a pixel, by ray queries.
#include "common/group_pixel.glsl"
#include "viewer/trace_query.glsl"
#include "viewer/path.glsl"

#define PIXEL_FUNCTION pathPixel
#include "common/for_each_pixel.glsl"
