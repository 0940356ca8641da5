// Light of what pixels show, by ray queries.
#include "common/group_pixel.glsl"
#include "viewer/trace_query.glsl"
#include "viewer/visible_light.glsl"

#define PIXEL_FUNCTION pathLaunch
#include "common/for_each_pixel.glsl"
