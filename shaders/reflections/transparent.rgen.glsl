// Reflections of transparent surfaces, by the ray tracing pipeline.
#include "reflections/trace_pipeline.glsl"
#include "reflections/reflect.glsl"

void main() {
    transparentPixel(gl_LaunchIDEXT.xy);
}
