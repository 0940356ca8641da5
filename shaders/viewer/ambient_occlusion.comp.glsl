// Light of what pixels show with ambient occlusion, by ray queries.
#include "viewer/ambient_occlusion.glsl"
#include "viewer/trace_query.glsl"
#include "viewer/visible_light.glsl"

#define PIXEL_FUNCTION pathLaunch
#include "common/for_each_pixel.glsl"
