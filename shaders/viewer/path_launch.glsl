// A launch over the paths of a picture. The first begins a path for each pixel. Each leads its paths on by a few surfaces and lists
// those that have not ended for the next, so that invocations which run together all have a path to follow: in one long loop most would
// wait for the longest of their group (Laine et al., "Megakernels Considered Harmful", 2013). `argument`: number of the launch, surfaces
// of each path in it (0: all that are left) and number of the sample, in 8, 8 and 16 bits.
//
// The including file provides beginPath(), advance() and endPath().
#ifndef VIEWER_PATH_LAUNCH
#define VIEWER_PATH_LAUNCH

#include "viewer/path.glsl"

// Words before the lists: three numbers of listed paths, of this launch, of the next, and of the one after that, in turn.
const uint kListHead = 4u;

uint pictureSize() {
    return frame.camera.width * frame.camera.height;
}

// The word of a launch's list with the pixel of its path `index`.
uint listPlace(uint launch, uint index) {
    return kListHead + (launch & 1u) * pictureSize() + index;
}

void pathLaunch(uvec2 at) {
    NumberArray lists = frame.pathLists;
    uint launch = argument & 0xffu;
    uint index = at.y * frame.camera.width + at.x;
    if (index == 0u) {
        lists.at[(launch + 2u) % 3u] = 0u;
    }
    if (launch > 0u && index >= lists.at[launch % 3u]) {
        return;
    }
    uint place = launch > 0u ? lists.at[listPlace(launch, index)] : index;
    uvec2 pixel = uvec2(place % frame.camera.width, place / frame.camera.width);
    Random random = randomOf(pixel, frame.sampleNumber + (argument >> 16));
    Path path;
    if (launch == 0u) {
        path = beginPath(pixel, random);
    } else {
        path = loadPath(place, random);
    }
    uint steps = argument >> 8 & 0xffu;
    uint step = 0u;
    bool isUnderWay = true;
    do {
        isUnderWay = advance(path, place, random);
        step += 1u;
    } while (isUnderWay && step != steps);
    if (isUnderWay) {
        storePath(place, path, random);
        uint next = atomicAdd(lists.at[(launch + 1u) % 3u], 1u);
        lists.at[listPlace(launch + 1u, next)] = place;
    } else {
        endPath(path, place);
    }
}

#endif
