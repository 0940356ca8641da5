// Orders the pixels so that those that show a mirror or glass come first: their rays take longest, and side by side they
// keep no others waiting. Others follow in small squares.
#include "hybrid/frame.glsl"
#include "hybrid/hit.glsl"
#include "hybrid/visible_triangle.glsl"

layout(local_size_x = 256) in;

const uvec2 kSquare = uvec2(16u, 16u); // of a workgroup
const uvec2 kBlock = uvec2(8u, 4u); // of neighbouring threads

shared uint counts[2];
shared uint starts[2];

uvec2 pixelOfThread() {
    uint thread = gl_LocalInvocationIndex;
    uint block = thread / (kBlock.x * kBlock.y);
    uvec2 place = uvec2(thread % kBlock.x, thread / kBlock.x % kBlock.y);
    return gl_WorkGroupID.xy * kSquare + uvec2(block % 2u, block / 2u) * kBlock + place;
}

bool goesOn(uvec2 pixel) {
    bool isInDoubt;
    uint triangle = visibleTriangle(pixel, isInDoubt);
    if (triangle == kNoTriangle) {
        return false;
    }
    Material material = frame.scene.materials.at[frame.scene.triangleInfos.at[triangle].material];
    return material.reflectivity > 0.0 || material.transmission > 0.0;
}

void main() {
    if (gl_LocalInvocationIndex < 2u) {
        counts[gl_LocalInvocationIndex] = 0u;
    }
    barrier();
    uvec2 pixel = pixelOfThread();
    bool isInside = pixel.x < frame.camera.width && pixel.y < frame.camera.height;
    uint kind = isInside && goesOn(pixel) ? 0u : 1u;
    uint place = isInside ? atomicAdd(counts[kind], 1u) : 0u;
    barrier();
    if (gl_LocalInvocationIndex == 0u) {
        starts[0] = atomicAdd(frame.order.firsts, counts[0]);
        starts[1] = atomicAdd(frame.order.others, counts[1]);
    }
    barrier();
    if (isInside) {
        uint number = starts[kind] + place;
        uint last = frame.camera.width * frame.camera.height - 1u;
        frame.order.at[kind == 0u ? number : last - number] = pixel.x | pixel.y << 16;
    }
}
