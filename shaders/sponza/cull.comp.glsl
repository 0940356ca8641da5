// A work group for each view: leaves the draws whose boxes its frustum may show, in their order.
#include "common/count_up_to_here.glsl"
#include "sponza/frame.glsl"

layout(local_size_x = 256) in;

// False only where the box is beyond one of the planes.
bool isSeen(uint view, uint number) {
    vec3 low = frame.draws.at[number].low;
    vec3 high = frame.draws.at[number].high;
    bool seen = true;
    for (uint i = 0u; i < 6u; ++i) {
        vec4 plane = frame.views[view].planes[i];
        vec3 innermost = mix(high, low, lessThan(plane.xyz, vec3(0.0)));
        seen = seen && dot(plane.xyz, innermost) + plane.w >= 0.0;
    }
    return seen;
}

void main() {
    uint view = gl_WorkGroupID.x;
    uint left = 0u;
    for (uint first = 0u; first < frame.drawCount; first += kGroup) {
        uint number = first + gl_LocalInvocationID.x;
        bool isDraw = number < frame.drawCount;
        bool seen = isDraw && isSeen(view, number);
        uint place = left + countUpToHere(seen ? 1u : 0u) - 1u;
        left += sums[kGroup - 1u];
        uvec4 draw = uvec4(0u);
        if (seen) {
            draw = uvec4(frame.draws.at[number].vertexCount, 1u, frame.draws.at[number].firstVertex, 0u);
        }
        if (frame.isPacked != 0u && seen) {
            frame.views[view].arguments.at[place] = draw;
        } else if (frame.isPacked == 0u && isDraw) {
            frame.views[view].arguments.at[number] = draw;
        }
        barrier();
    }
    if (gl_LocalInvocationID.x == 0u) {
        frame.counts.at[view] = left;
    }
}
