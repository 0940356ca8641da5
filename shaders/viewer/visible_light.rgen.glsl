// Light of what pixels show, by the ray tracing pipeline.
#include "viewer/trace_pipeline.glsl"
#include "viewer/visible_light.glsl"

void main() {
    pathLaunch(gl_LaunchIDEXT.xy);
}
