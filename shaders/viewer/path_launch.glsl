// A launch over the paths of a picture. The first begins a path for each pixel. Each leads its paths on by a few surfaces and lists
// those that have not ended for the next, so that invocations which run together all have a path to follow: in one long loop most would
// wait for the longest of their group (Laine et al., "Megakernels Considered Harmful", 2013). `argument`, from the lowest bit:
// the turn of the launch among the three numbers and the two lists, from 0 to 5 (3 bits); whether the launch begins paths (1 bit); surfaces
// of each path in it, or 0 for all that are left (8 bits from bit 8 on); and the number of the sample (16 bits).
//
// The including file provides beginPath(), advance() and endPath().
#ifndef VIEWER_PATH_LAUNCH
#define VIEWER_PATH_LAUNCH

#include "viewer/light_turn.glsl"
#include "viewer/path.glsl"

const uint kBeginsPaths = 8u;
// Words before the lists: three numbers of listed paths, of this launch, of the next, and of the one after that, in turn.
const uint kListHead = 4u;

// The word of the list of a turn with the pixel of path `index`.
uint listPlace(uint turn, uint index) {
    return kListHead + (turn & 1u) * frame.pixelCount + index;
}

void pathLaunch(uvec2 at) {
    NumberArray lists = frame.pathLists;
    uint turn = argument & 7u;
    bool begins = (argument & kBeginsPaths) != 0u;
    uint index = at.y * frame.camera.width + at.x;
    if (index == 0u) {
        lists.at[(turn + 2u) % 3u] = 0u;
    }
    if (!begins && index >= lists.at[turn % 3u]) {
        return;
    }
    uvec2 pixel = begins ? pixelOfInvocation(at) : pixelOf(lists.at[listPlace(turn, index)]);
    uint place = pixel.y * frame.camera.width + pixel.x;
    Random random = randomOf(pixel, firstSample(pixel) + (argument >> 16));
    Path path;
    if (begins) {
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
        uint next = atomicAdd(lists.at[(turn + 1u) % 3u], 1u);
        lists.at[listPlace(turn + 1u, next)] = place;
    } else {
        endPath(path, place);
    }
}

#endif
