// Light of a pixel, by ray queries.
#include "common/group_pixel.glsl"
#include "viewer/trace_query.glsl"
#include "viewer/visible_light.glsl"

void main() {
    visibleLight();
}
