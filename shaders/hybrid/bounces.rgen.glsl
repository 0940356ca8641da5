// The further rays of a queued pixel by the ray tracing pipeline.
#define HYBRID_BOUNCES
#include "hybrid/trace_pipeline.glsl"
#include "hybrid/pixel.glsl"

void main() {
    renderBounces(gl_LaunchIDEXT.x);
}
