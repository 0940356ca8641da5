// Paths of the path tracer, by the ray tracing pipeline.
#include "viewer/trace_pipeline.glsl"
#include "viewer/sample_path.glsl"

void main() {
    pathLaunch(gl_LaunchIDEXT.xy);
}
