// Reflections of opaque surfaces, by the ray tracing pipeline.
#include "reflections/trace_pipeline.glsl"
#include "reflections/reflect.glsl"

void main() {
    opaquePixel(gl_LaunchIDEXT.xy);
}
