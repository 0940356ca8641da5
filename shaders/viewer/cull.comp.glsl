// A work group for each mesh: leaves the instances whose boxes the picture may show, in their order, so that surfaces at the same
// depth stay in the order that they have without culling.
#include "common/count_up_to_here.glsl"
#include "viewer/frame.glsl"

layout(local_size_x = 256) in;

// How far rounding may move a point, as a share of its coordinates.
const float kRounding = 1e-5;

// A box in the world, as seen from the eye.
struct Box {
    vec3 middle;
    vec3 axes[3]; // half of its edges
    float slack;
};

Box boxOf(MeshRun run, Instance instance) {
    Box box;
    vec3 middle = vec3(dot(instance.rows[0], vec4(run.middle, 1.0)), dot(instance.rows[1], vec4(run.middle, 1.0)),
                       dot(instance.rows[2], vec4(run.middle, 1.0)));
    float size = 0.0;
    for (uint axis = 0u; axis < 3u; ++axis) {
        box.axes[axis] = run.extent[axis] * vec3(instance.rows[0][axis], instance.rows[1][axis], instance.rows[2][axis]);
        size += length(box.axes[axis]);
    }
    box.middle = middle - frame.camera.eye;
    box.slack = kRounding * (length(middle) + length(frame.camera.eye) + size);
    return box;
}

// False only where the box is beyond a plane through the eye whose inner side is along `normal`.
bool reaches(Box box, vec3 normal) {
    float reach = abs(dot(box.axes[0], normal)) + abs(dot(box.axes[1], normal)) + abs(dot(box.axes[2], normal));
    return !(dot(box.middle, normal) + reach < -box.slack * length(normal));
}

bool isSeen(MeshRun run, uint number) {
    if (run.extent.x < 0.0) {
        return true;
    }
    Camera camera = frame.camera;
    Box box = boxOf(run, frame.instances.at[number]);
    // Two pixels more than the picture, and its shift.
    vec2 edge = 1.0 + abs(camera.shift) + 4.0 / vec2(camera.width, camera.height);
    return reaches(box, camera.forward) && reaches(box, edge.x * camera.forward - camera.clipRight) &&
           reaches(box, edge.x * camera.forward + camera.clipRight) &&
           reaches(box, edge.y * camera.forward - camera.clipDown) &&
           reaches(box, edge.y * camera.forward + camera.clipDown);
}

void main() {
    MeshRun run = frame.runs.at[gl_WorkGroupID.x];
    uint left = 0u;
    for (uint first = 0u; first < run.instanceCount; first += kGroup) {
        uint place = first + gl_LocalInvocationID.x;
        bool seen = place < run.instanceCount && isSeen(run, run.firstInstance + place);
        uint rank = left + countUpToHere(seen ? 1u : 0u) - 1u;
        left += sums[kGroup - 1u];
        if (seen) {
            frame.visible.at[run.firstInstance + rank] = run.firstInstance + place;
        }
        barrier();
    }
    for (uint draw = gl_LocalInvocationID.x; draw < run.drawCount; draw += kGroup) {
        frame.drawArguments.at[run.firstDraw + draw].y = left;
    }
    if (gl_LocalInvocationID.x == 0u) {
        frame.drawnCounts.at[gl_WorkGroupID.x] = left;
    }
}
