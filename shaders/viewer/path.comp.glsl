// Paths of the path tracer, by ray queries.
#include "common/group_pixel.glsl"
#include "viewer/trace_query.glsl"
#include "viewer/sample_path.glsl"

#define PIXEL_FUNCTION pathLaunch
#include "common/for_each_pixel.glsl"
