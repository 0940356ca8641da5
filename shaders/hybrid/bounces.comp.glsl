// The further rays of a queued pixel by ray queries.
#define HYBRID_BOUNCES
#include "hybrid/trace_query.glsl"
#include "hybrid/pixel.glsl"

layout(local_size_x = kBounceGroup) in;

void main() {
    renderBounces(gl_GlobalInvocationID.x);
}
