// A work group for each mesh: leaves the instances whose boxes the picture may show, in their order, so that surfaces at the same
// depth stay in the order that they have without culling. Occlusion culling runs it twice, after "GPU-Driven Rendering Pipelines"
// (Haar and Aaltonen, 2015): what was visible is drawn first, and what its depth does not hide is drawn then.
#include "common/count_up_to_here.glsl"
#include "viewer/frame.glsl"
#include "viewer/occlusion.glsl"

layout(local_size_x = 256) in;

// Values of `argument`: the instances that are left.
const uint kCullByFrustum = 0u; // all in the frustum
const uint kCullByLastVisible = 1u; // those of them that were visible in the frame before
const uint kCullByPyramid = 2u; // those of the others that the depth of the former does not hide

// How far rounding may move a point, as a share of its coordinates.
const float kRounding = 1e-5;

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

// Vertices that move have no box, and are drawn in each frame.
bool hasBox(MeshRun run) {
    return run.extent.x >= 0.0;
}

bool isInFrustum(Box box) {
    Camera camera = frame.camera;
    // Two pixels more than the picture, and its shift.
    vec2 edge = 1.0 + abs(camera.shift) + 4.0 / vec2(camera.width, camera.height);
    return reaches(box, camera.forward) && reaches(box, edge.x * camera.forward - camera.clipRight) &&
           reaches(box, edge.x * camera.forward + camera.clipRight) &&
           reaches(box, edge.y * camera.forward - camera.clipDown) &&
           reaches(box, edge.y * camera.forward + camera.clipDown);
}

bool isHidden(Box box) {
    PixelBounds bounds;
    if (!boundsOf(box, frame.camera, bounds)) {
        return false;
    }
    uvec2 pixels = uvec2(frame.camera.width, frame.camera.height);
    uint level = levelOf(bounds);
    uint first = levelPlace(pixels, level);
    uint columns = levelSize(pixels, level).x;
    uvec2 high = bounds.high >> level;
    for (uint y = bounds.low.y >> level; y <= high.y; ++y) {
        for (uint x = bounds.low.x >> level; x <= high.x; ++x) {
            if (!(bounds.depth < frame.pyramid.at[first + y * columns + x])) {
                return false;
            }
        }
    }
    return true;
}

// Bits of what is counted: an instance is drawn, and it is in the frustum.
const uint kDrawn = 1u;
const uint kInFrustum = 0x10000u;

// The bits of an instance.
uint verdict(MeshRun run, uint number) {
    Box box = boxOf(run, frame.instances.at[number]);
    bool isWithin = !hasBox(run) || isInFrustum(box);
    if (argument == kCullByFrustum) {
        return isWithin ? kDrawn | kInFrustum : 0u;
    }
    bool wasVisible = !hasBox(run) || frame.wasVisible.at[number] != 0u;
    if (argument == kCullByLastVisible) {
        return isWithin ? kInFrustum | (wasVisible ? kDrawn : 0u) : 0u;
    }
    bool isVisible = isWithin && !(hasBox(run) && isHidden(box));
    frame.wasVisible.at[number] = isVisible ? 1u : 0u;
    return isVisible && !wasVisible ? kDrawn : 0u;
}

void main() {
    MeshRun run = frame.runs.at[gl_WorkGroupID.x];
    uint left = 0u;
    uint within = 0u;
    for (uint first = 0u; first < run.instanceCount; first += kGroup) {
        uint place = first + gl_LocalInvocationID.x;
        uint bits = place < run.instanceCount ? verdict(run, run.firstInstance + place) : 0u;
        uint rank = left + countUpToHere(bits) % kInFrustum - 1u;
        uint all = sums[kGroup - 1u];
        left += all % kInFrustum;
        within += all / kInFrustum;
        if ((bits & kDrawn) != 0u) {
            frame.visible.at[run.firstInstance + rank] = run.firstInstance + place;
        }
        barrier();
    }
    for (uint draw = gl_LocalInvocationID.x; draw < run.drawCount; draw += kGroup) {
        frame.drawArguments.at[run.firstDraw + draw].y = left;
    }
    if (gl_LocalInvocationID.x == 0u) {
        uint before = argument == kCullByPyramid ? frame.drawnCounts.at[2u * gl_WorkGroupID.x] : 0u;
        frame.drawnCounts.at[2u * gl_WorkGroupID.x] = before + left;
        if (argument != kCullByPyramid) {
            frame.drawnCounts.at[2u * gl_WorkGroupID.x + 1u] = within;
        }
    }
}
