// The probe of the surfaces around the eye, by the ray tracing pipeline.
#include "viewer/trace_pipeline.glsl"
#include "viewer/ambient_probe.glsl"

void main() {
    probe(gl_LaunchIDEXT.xy);
}
