// The lists of nodes: every pixel's head leads to the node added last, every node to the one before.
#ifndef HYBRID_OIT_LIST
#define HYBRID_OIT_LIST

#include "hybrid_oit/frame.glsl"

uint headOf(uvec2 pixel) {
    return pixel.y * frame.camera.width + pixel.x;
}

// Adds a node, or counts it as lost where the pool is used up.
void addNode(uvec2 pixel, float distance, vec3 radiance, vec3 transmittance) {
    uint index = atomicAdd(frame.nodeCount.at[0], 1u);
    if (index >= frame.nodeCapacity) {
        return;
    }
    uvec3 packed = uvec3(packHalf2x16(radiance.rg), packHalf2x16(vec2(radiance.b, transmittance.r)),
                         packHalf2x16(transmittance.gb));
    uint next = atomicExchange(frame.heads.at[headOf(pixel)], index);
    frame.nodes.at[index] = Node(next, distance, packed);
}

vec3 nodeRadiance(Node node) {
    return vec3(unpackHalf2x16(node.packed.x), unpackHalf2x16(node.packed.y).x);
}

vec3 nodeTransmittance(Node node) {
    return vec3(unpackHalf2x16(node.packed.y).y, unpackHalf2x16(node.packed.z));
}

// A node, and what it is sorted by.
struct Place {
    float distance;
    uint node;
};

// Nearest first. Nodes as near as each other go by what they hold, so that the order in which fragments ran does not
// show; those that hold the same are as good as each other.
bool isBefore(Place a, Place b) {
    if (a.distance != b.distance) {
        return a.distance < b.distance;
    }
    uvec3 first = frame.nodes.at[a.node].packed;
    uvec3 second = frame.nodes.at[b.node].packed;
    for (int i = 0; i < 3; i++) {
        if (first[i] != second[i]) {
            return first[i] < second[i];
        }
    }
    return a.node < b.node;
}

// Nodes sorted at a time; longer lists are walked again for the next ones.
const uint kBatch = 8u;

struct Batch {
    Place at[kBatch];
    uint count;
    bool isLast;
};

void insertNode(inout Batch batch, Place place) {
    if (batch.count == kBatch) {
        batch.isLast = false;
        if (!isBefore(place, batch.at[kBatch - 1u])) {
            return;
        }
        batch.count--;
    }
    uint index = batch.count;
    for (; index > 0u && isBefore(place, batch.at[index - 1u]); index--) {
        batch.at[index] = batch.at[index - 1u];
    }
    batch.at[index] = place;
    batch.count++;
}

// The nearest nodes of a list behind `last`, or of all where that is no node.
Batch nearestNodes(uint head, Place last) {
    Batch batch;
    batch.count = 0u;
    batch.isLast = true;
    for (uint node = head; node != kNoNode; node = frame.nodes.at[node].next) {
        Place place = Place(frame.nodes.at[node].distance, node);
        if (last.node == kNoNode || isBefore(last, place)) {
            insertNode(batch, place);
        }
    }
    return batch;
}

// Blends the nodes of a list over `background`, nearest first.
vec3 throughNodes(uint head, vec3 background) {
    vec3 radiance = vec3(0.0);
    vec3 transmittance = vec3(1.0);
    Place last = Place(0.0, kNoNode);
    bool isDone = head == kNoNode;
    while (!isDone) {
        Batch batch = nearestNodes(head, last);
        for (uint i = 0u; i < batch.count; i++) {
            last = batch.at[i];
            Node node = frame.nodes.at[last.node];
            radiance += transmittance * nodeRadiance(node);
            transmittance *= nodeTransmittance(node);
        }
        isDone = batch.isLast;
    }
    return radiance + transmittance * background;
}

#endif
