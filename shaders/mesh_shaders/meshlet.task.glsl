// Chooses the meshlets that can be seen: an invocation for each, and a mesh workgroup for each that is left.
#include "mesh_shaders/frame.glsl"
#include "mesh_shaders/payload.glsl"
layout(local_size_x = kMeshletsPerTask) in;

taskPayloadSharedEXT Chosen chosen;
shared uint count;

// True if all triangles turn their backs.
bool looksAway(Meshlet meshlet, vec3 middle, vec3 eye) {
    vec3 seen = middle - eye;
    return dot(seen, turned(meshlet.axis)) >= meshlet.cutoff * length(seen) + meshlet.radius;
}

// True if the sphere lies beyond one of the picture's edges, or before the near plane.
bool isOutside(vec3 middle, float radius, Camera camera) {
    vec3 offset = middle - camera.eye;
    float depth = dot(offset, camera.forward);
    vec2 place = abs(vec2(dot(offset, camera.clipRight), dot(offset, camera.clipDown)));
    vec2 slope = vec2(length(camera.clipRight - camera.forward), length(camera.clipDown - camera.forward));
    return depth + radius < camera.nearPlane || any(greaterThan(place - depth, radius * slope));
}

bool canBeSeen(uint number) {
    if (frame.culls == 0u) {
        return true;
    }
    Meshlet meshlet = frame.meshlets.at[number];
    vec3 middle = turned(meshlet.middle + movedBy(number));
    return !looksAway(meshlet, middle, frame.cullingCamera.eye) && !isOutside(middle, meshlet.radius, frame.cullingCamera);
}

void main() {
    uint number = gl_GlobalInvocationID.x;
    if (gl_LocalInvocationIndex == 0u) {
        count = 0u;
    }
    barrier();
    if (number < frame.count && canBeSeen(number)) {
        chosen.meshlets[atomicAdd(count, 1u)] = number;
    }
    barrier();
    if (gl_LocalInvocationIndex == 0u) {
        atomicAdd(frame.counter.drawn, count);
    }
    EmitMeshTasksEXT(count, 1, 1);
}
