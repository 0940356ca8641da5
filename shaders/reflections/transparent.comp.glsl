// Reflections of transparent surfaces, by ray queries.
#include "common/group_pixel.glsl"
#include "reflections/trace_query.glsl"
#include "reflections/reflect.glsl"

#define PIXEL_FUNCTION transparentPixel
#include "common/for_each_pixel.glsl"
