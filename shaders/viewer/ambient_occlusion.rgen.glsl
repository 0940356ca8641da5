// Light of what pixels show with ambient occlusion, by the ray tracing pipeline.
#include "viewer/ambient_occlusion.glsl"
#include "viewer/trace_pipeline.glsl"
#include "viewer/visible_light.glsl"

void main() {
    pathLaunch(gl_LaunchIDEXT.xy);
}
