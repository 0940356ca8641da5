#ifndef LVK_SOFTWARE_WALK_GLSL
#define LVK_SOFTWARE_WALK_GLSL

// The state of a query with software traversal, and its traversal of both levels.
#include <lvk/ray_flags.glsl>
#include <lvk/software_boxes.glsl>
#include <lvk/software_layout.glsl>
#include <lvk/software_stack.glsl>
#include <lvk/software_triangle.glsl>
#ifdef LVK_DEVICE_IS_CPU
#include <lvk/software_cpu_node.glsl>
#else
#include <lvk/software_wide_node.glsl>
#endif

// Values of LvkSoftHit.kind for candidates. Committed hits have LVK_COMMITTED_*.
#define LVK_SOFT_CANDIDATE_TRIANGLE 0u
#define LVK_SOFT_CANDIDATE_BOX 1u

struct LvkSoftHit {
    float t;
    uint kind;
    uint instance;  // index in the TLAS
    uint primitive; // index among the leaves of the instance's BLAS
    uvec2 numbers;  // the application's geometry and primitive
    vec2 barycentrics;
    bool front;
    bool opaque;
};

// The pending work. Stack entries from `top` on belong to others; those below `floor` are references of the TLAS.
struct LvkSoftPlace {
    uint next;     // reference of the TLAS to visit before those on the stack, or LVK_SOFT_NONE
    uint instance; // instance whose BLAS is traversed, or LVK_SOFT_NONE
    uvec2 group;   // nodes: a group as lvkSoftMeet8 returns it, or the index of a binary node and LVK_SOFT_ONE_NODE
    uvec2 leaves;  // primitives: the first, and a bit mask from it on
    uint top;
    uint floor;
};

// A query without its stack, small enough to be passed in and out of functions.
struct LvkSoftState {
    uvec2 tlas;
    vec3 origin;
    float tMin;
    vec3 direction;
    uint flags;
    uint mask;
    uint id;
    bool interrupted; // a candidate waits, and the query stores the stack
    LvkSoftPlace place;
    LvkSoftHit candidate;
    LvkSoftHit committed;
};

// The BLAS of an instance, and the ray in its space.
struct LvkSoftLevel {
    LvkSoftSlabs slabs;
    LvkSoftShear shear;
    uvec2 structure;
    uint nodes;      // first blocks of nodes and primitives
    uint primitives;
    bool wide;
    bool several; // more than one geometry
    uint kind;    // kind of the leaves
    uint opacity; // of all primitives: LVK_SOFT_CLEAR, LVK_SOFT_OPAQUE, or LVK_SOFT_EACH if primitives differ
    uint cull;    // LVK_RAY_FLAG_CULL_* of faces
    bool flip;
};

#define LVK_SOFT_ONE_NODE 0x80000000u
#define LVK_SOFT_ANY_NODE 0x01000000u

// Constants, so that compilers remove the code that a module without candidates does not need.
#ifdef LVK_OPAQUE_TRIANGLES_ONLY
const bool kLvkSoftHasCandidates = false;
#else
const bool kLvkSoftHasCandidates = true;
#endif

// lavapipe drops writes of helper invocations to their own arrays (mesa 25.0), so helper invocations have no stack.
#if defined(LVK_STAGE_FRAGMENT) && defined(LVK_HELPERS_LOSE_ARRAYS)
#define LVK_SOFT_IS_STACKLESS gl_HelperInvocation
#else
#define LVK_SOFT_IS_STACKLESS false
#endif

#define LVK_SOFT_CLEAR 0u
#define LVK_SOFT_OPAQUE 1u
#define LVK_SOFT_EACH 2u

#define LVK_SOFT_CULL_FACES (LVK_RAY_FLAG_CULL_BACK_FACING_TRIANGLES | LVK_RAY_FLAG_CULL_FRONT_FACING_TRIANGLES)

// The query that owns the stack, and the number of queries so far.
uint lvkSoftOwner = 0u;
uint lvkSoftQueries = 0u;

// Moves to the node or leaf of a reference.
void lvkSoftGo(inout LvkSoftPlace place, uint reference) {
    bool isLeaf = (reference & LVK_SOFT_LEAF) != 0u;
    uint count = (reference & LVK_SOFT_LEAF_COUNT) / LVK_SOFT_LEAF_ONE + 1u;
    place.group = isLeaf ? uvec2(0u) : uvec2(reference, LVK_SOFT_ONE_NODE);
    place.leaves = isLeaf ? uvec2(reference & LVK_SOFT_LEAF_FIRST, (1u << count) - 1u) : uvec2(0u);
}

bool lvkSoftIsCulled(uint flags, bool opaque) {
    return (flags & (opaque ? LVK_RAY_FLAG_CULL_OPAQUE : LVK_RAY_FLAG_CULL_NO_OPAQUE)) != 0u;
}

uint lvkSoftOpacity(uint marks, uint instanceFlags, uint rayFlags) {
    uint opacity = (marks & LVK_SOFT_ALL_OPAQUE) != 0u ? LVK_SOFT_OPAQUE
        : (marks & LVK_SOFT_NONE_OPAQUE) != 0u ? LVK_SOFT_CLEAR : LVK_SOFT_EACH;
    opacity = (instanceFlags & LVK_SOFT_FORCE_OPAQUE) != 0u ? LVK_SOFT_OPAQUE : opacity;
    opacity = (instanceFlags & LVK_SOFT_FORCE_NO_OPAQUE) != 0u ? LVK_SOFT_CLEAR : opacity;
    opacity = (rayFlags & LVK_RAY_FLAG_OPAQUE) != 0u ? LVK_SOFT_OPAQUE : opacity;
    return (rayFlags & LVK_RAY_FLAG_NO_OPAQUE) != 0u ? LVK_SOFT_CLEAR : opacity;
}

// Returns the three rows of a matrix, each in a block.
mat3x4 lvkSoftRows(uvec2 base, uint first) {
    LvkSoftBlocks blocks = LvkSoftBlocks(base);
    return mat3x4(uintBitsToFloat(lvkSoftBlock(blocks, first)), uintBitsToFloat(lvkSoftBlock(blocks, first + 1u)),
                  uintBitsToFloat(lvkSoftBlock(blocks, first + 2u)));
}

// Multiplies three rows of a matrix with a vector. A ray that resumes in an instance must be bitwise the same, so
// compilers must not compute it differently at different places.
vec3 lvkSoftTransform(mat3x4 rows, vec4 v) {
    mat4x3 columns = transpose(rows);
    precise vec3 last = columns[3] * v.w;
    precise vec3 moved = fma(columns[0], v.xxx, fma(columns[1], v.yyy, fma(columns[2], v.zzz, last)));
    return moved;
}

// Returns the address of the instances of the traced TLAS.
uvec2 lvkSoftInstances(LvkSoftState state) {
    return lvkSoftBehind(state.tlas, LvkSoftBlocks(state.tlas).at[1].y);
}

// Returns the BLAS that an instance with this address refers to, and its first block. Follows a moved BLAS.
uvec2 lvkSoftStructureOf(uvec2 named, out uvec4 head) {
    head = lvkSoftBlock(LvkSoftBlocks(named), 0u);
    if (head.x != LVK_SOFT_MOVED) {
        return named;
    }
    uvec2 moved = head.zw;
    head = lvkSoftBlock(LvkSoftBlocks(moved), 0u);
    return moved;
}

// Returns the BLAS of an instance and the ray in its space. The result is the reference to start at, or LVK_SOFT_NONE
// if the ray skips the instance.
uint lvkSoftEnter(LvkSoftState state, uvec2 instances, uint instance, out LvkSoftLevel level) {
    uint first = instance * LVK_SOFT_INSTANCE_BLOCKS;
    uvec4 numbers = lvkSoftBlock(LvkSoftBlocks(instances), first + 6u);
    uint entry = lvkSoftBlock(LvkSoftBlocks(instances), first + 7u).y;
    mat3x4 rows = lvkSoftRows(instances, first);
    vec3 origin = lvkSoftTransform(rows, vec4(state.origin, 1.0));
    vec3 direction = lvkSoftTransform(rows, vec4(state.direction, 0.0));
    if ((numbers.z >> 24 & state.mask) == 0u) {
        return LVK_SOFT_NONE;
    }
    uvec4 head;
    level.structure = lvkSoftStructureOf(numbers.xy, head);
    uvec4 places = lvkSoftBlock(LvkSoftBlocks(level.structure), 1u);
    uvec4 counts = lvkSoftBlock(LvkSoftBlocks(level.structure), 2u);
    uint flags = numbers.w >> 24;
    level.wide = head.x == LVK_SOFT_WIDE;
    level.several = counts.y > 1u;
    level.kind = head.y;
    level.opacity = lvkSoftOpacity(counts.w, flags, state.flags);
    level.cull = (flags & LVK_SOFT_NO_CULL) != 0u ? 0u : state.flags & LVK_SOFT_CULL_FACES;
    level.flip = (flags & LVK_SOFT_FLIP_FACING) != 0u;
    level.nodes = places.x;
    level.primitives = places.y;
    level.slabs = lvkSoftSlabsOf(origin, direction, lvkSoftLeast(level.structure, origin, direction));
    level.shear = lvkSoftShearOf(direction);
    bool isBox = level.kind == LVK_SOFT_BOXES;
    uint skip = isBox ? LVK_RAY_FLAG_SKIP_AABBS : LVK_RAY_FLAG_SKIP_TRIANGLES;
    bool skipped = (state.flags & skip) != 0u || (isBox && !kLvkSoftHasCandidates);
    bool culled = level.opacity != LVK_SOFT_EACH && lvkSoftIsCulled(state.flags, level.opacity == LVK_SOFT_OPAQUE);
    // The entry point is a part of the BLAS. A moved BLAS has other parts, and is entered at its root.
    uint start = entry != 0u && level.structure == numbers.xy ? entry : head.z;
    return culled || skipped ? LVK_SOFT_NONE : start;
}

// Removes the next node of a wide tree from the group.
uint lvkSoftTakeNode(inout LvkSoftPlace place, LvkSoftLevel level) {
    uint bit = uint(findMSB(place.group.y));
    uint slot = bit - 24u ^ level.slabs.octant;
    uint before = bitCount(place.group.y & 0xFFu & (1u << slot) - 1u);
    place.group.y ^= 1u << bit;
    return place.group.x + before;
}

// Visits the next node of the group.
void lvkSoftVisit(inout LvkSoftPlace place, LvkSoftLevel level, vec2 range) {
    if (level.wide) {
        uint node = lvkSoftTakeNode(place, level);
        if (place.group.y >= LVK_SOFT_ANY_NODE) {
            lvkSoftPushGroup(place.top, place.group);
        }
        uvec4 met = lvkSoftMeet8(level.slabs, level.structure, level.nodes, node, range);
        place.group = met.xy;
        place.leaves = met.zw;
    } else {
        uvec2 met = lvkSoftMeet2(level.slabs, LvkSoftBlocks(level.structure), level.nodes, place.group.x, range, false,
                                 vec3(0.0));
        place.group = uvec2(0u);
        if (met.y != LVK_SOFT_NONE) {
            lvkSoftPushReference(place.top, met.y);
        }
        if (met.x != LVK_SOFT_NONE) {
            lvkSoftGo(place, met.x);
        }
    }
}

// Pops the last entry that this level has pushed.
void lvkSoftResume(inout LvkSoftPlace place, LvkSoftLevel level) {
    uvec2 entry = lvkSoftPop(place.top, level.wide);
    if (level.wide) {
        place.group = entry;
    } else {
        lvkSoftGo(place, entry.x);
    }
}

LvkSoftHit lvkSoftNoHit(float t) {
    return LvkSoftHit(t, 0u, LVK_SOFT_NONE, 0u, uvec2(0u), vec2(0.0), false, false);
}

// Ends the traversal.
void lvkSoftFinish(inout LvkSoftPlace place) {
    place = LvkSoftPlace(LVK_SOFT_NONE, LVK_SOFT_NONE, uvec2(0u), uvec2(0u), 0u, 0u);
}

// Commits a hit; ends the traversal if that is enough.
void lvkSoftCommit(inout LvkSoftState state, inout LvkSoftPlace place, LvkSoftHit hit, uint kind) {
    state.committed = hit;
    state.committed.kind = kind;
    if ((state.flags & LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT) != 0u) {
        lvkSoftFinish(place);
    }
}

// Returns the vertex indices of a triangle, and the word with its ids.
uvec4 lvkSoftNames(uvec2 structure, uint primitives, uint kind, uint primitive) {
    if (kind == LVK_SOFT_INDEXED) {
        return LvkSoftBlocks(structure).at[primitives + primitive];
    }
    uvec3 leaf = LvkSoftTriples(lvkSoftBehind(structure, primitives)).at[primitive];
    uvec2 rest = leaf.xy >> LVK_SOFT_NAME_BITS;
    return uvec4(leaf.xy & LVK_SOFT_NAME, rest.x | rest.y << LVK_SOFT_REST_BITS, leaf.z);
}

// Returns the vertices of a triangle whose leaf starts at block `first`. `words` are the other words of the leaf.
void lvkSoftReadTriangle(LvkSoftBlocks blocks, uint first, out vec3 corners[3], out uvec3 words) {
    uvec4 a = lvkSoftBlock(blocks, first);
    uvec4 b = lvkSoftBlock(blocks, first + 1u);
    uvec4 c = lvkSoftBlock(blocks, first + 2u);
    corners[0] = uintBitsToFloat(a.xyz);
    corners[1] = uintBitsToFloat(b.xyz);
    corners[2] = uintBitsToFloat(c.xyz);
    words = uvec3(a.w, b.w, c.w);
}

// Like lvkSoftReadTriangle, for any kind of leaf.
void lvkSoftCorners(uvec2 structure, uint primitives, uint kind, uint primitive, out vec3 corners[3],
                    out uvec3 words) {
    LvkSoftBlocks blocks = LvkSoftBlocks(structure);
    if (kind != LVK_SOFT_TRIANGLES) {
        uvec4 vertices = lvkSoftNames(structure, primitives, kind, primitive);
        uvec2 points = lvkSoftBehind(structure, blocks.at[1].z);
        corners[0] = LvkSoftVertices(points).at[vertices.x];
        corners[1] = LvkSoftVertices(points).at[vertices.y];
        corners[2] = LvkSoftVertices(points).at[vertices.z];
        words = uvec3(vertices.w, 0u, 0u);
    } else {
        uint first = lvkSoftBegin(blocks, primitives + primitive * LVK_SOFT_TRIANGLE_BLOCKS);
        lvkSoftReadTriangle(blocks, first, corners, words);
    }
}

// Returns the application's ids of a triangle, geometry and primitive, from the words of its leaf.
uvec2 lvkSoftNumbers(uvec3 words, uint kind, bool several) {
    bool inOneWord = kind != LVK_SOFT_TRIANGLES && several;
    uint geometry = inOneWord ? words.x >> 24 : words.y & 0x7FFFFFFFu;
    return uvec2(geometry, inOneWord ? words.x & 0x00FFFFFFu : words.x);
}

// Returns true if a primitive is opaque, in a BLAS where primitives differ. For leaves with vertex indices, the
// geometry decides.
bool lvkSoftSaysOpaque(LvkSoftLevel level, LvkSoftHit hit) {
    if (level.kind == LVK_SOFT_TRIANGLES || level.kind == LVK_SOFT_BOXES) {
        return hit.opaque;
    }
    uvec2 geometries = lvkSoftBehind(level.structure, LvkSoftBlocks(level.structure).at[1].w);
    return (LvkSoftBlocks(geometries).at[hit.numbers.x].x & 1u) != 0u;
}

// Returns true if the ray hits or touches an AABB primitive. An AABB with swapped minimum and maximum is empty.
bool lvkSoftMeetsBox(LvkSoftState state, LvkSoftLevel level, inout LvkSoftHit hit) {
    uint first = level.primitives + hit.primitive * LVK_SOFT_BOX_BLOCKS;
    uvec4 a = lvkSoftBlock(LvkSoftBlocks(level.structure), first);
    uvec4 b = lvkSoftBlock(LvkSoftBlocks(level.structure), first + 1u);
    hit.numbers = uvec2(b.w & 0x7FFFFFFFu, a.w);
    hit.opaque = (b.w & 0x80000000u) != 0u;
    vec3 low = uintBitsToFloat(a.xyz), high = uintBitsToFloat(b.xyz);
    vec2 range = lvkSoftCross(level.slabs, low, high, vec2(state.tMin, state.committed.t),
                              lvkSoftTouchSlack(level.slabs, low, high));
    return all(lessThanEqual(low, high)) && range.x <= range.y;
}

// Returns the flag that culls triangles facing this way.
uint lvkSoftCulling(bool front) {
    return front ? LVK_RAY_FLAG_CULL_FRONT_FACING_TRIANGLES : LVK_RAY_FLAG_CULL_BACK_FACING_TRIANGLES;
}

// Returns true if the ray hits a triangle strictly between tMin and tMax, and the triangle's side is not culled.
bool lvkSoftHitsTriangle(LvkSoftState state, LvkSoftLevel level, inout LvkSoftHit hit) {
    vec3 corners[3];
    uvec3 words;
    lvkSoftCorners(level.structure, level.primitives, level.kind, hit.primitive, corners, words);
    LvkSoftPassage passage;
    if (!lvkSoftPasses(level.shear, level.slabs.origin, corners, passage)) {
        return false;
    }
    if (!(passage.t > state.tMin && passage.t < state.committed.t)) {
        return false;
    }
    hit.t = passage.t;
    hit.numbers = lvkSoftNumbers(words, level.kind, level.several);
    hit.opaque = (words.z & 1u) != 0u;
    hit.barycentrics = passage.barycentrics;
    hit.front = passage.front != level.flip;
    return (level.cull & lvkSoftCulling(hit.front)) == 0u;
}

// Tests the next primitive. Returns true if it is a candidate that the shader must judge.
bool lvkSoftTest(inout LvkSoftState state, inout LvkSoftPlace place, LvkSoftLevel level) {
    uint primitive = place.leaves.x + uint(findLSB(place.leaves.y));
    place.leaves.y &= place.leaves.y - 1u;
    bool isBox = kLvkSoftHasCandidates && level.kind == LVK_SOFT_BOXES;
    LvkSoftHit hit = lvkSoftNoHit(0.0);
    hit.instance = place.instance;
    hit.primitive = primitive;
    bool isHit = isBox ? lvkSoftMeetsBox(state, level, hit) : lvkSoftHitsTriangle(state, level, hit);
    if (!isHit) {
        return false;
    }
    if (!kLvkSoftHasCandidates) {
        lvkSoftCommit(state, place, hit, 1u);
        return false;
    }
    hit.opaque = level.opacity == LVK_SOFT_EACH ? lvkSoftSaysOpaque(level, hit) : level.opacity == LVK_SOFT_OPAQUE;
    if (lvkSoftIsCulled(state.flags, hit.opaque)) {
        return false;
    }
    if (hit.opaque && !isBox) {
        lvkSoftCommit(state, place, hit, 1u);
        return false;
    }
    state.candidate = hit;
    state.candidate.kind = isBox ? LVK_SOFT_CANDIDATE_BOX : LVK_SOFT_CANDIDATE_TRIANGLE;
    return true;
}

// Returns the next reference of the TLAS; LVK_SOFT_NONE if none is left.
uint lvkSoftNextReference(inout LvkSoftPlace place) {
    uint next = place.next;
    place.next = LVK_SOFT_NONE;
    return next != LVK_SOFT_NONE || place.top == 0u ? next : lvkSoftPopReference(place.top);
}

// Returns the next leaf of the TLAS that the ray hits, from a node on; LVK_SOFT_NONE if none is left.
uint lvkSoftDescend(LvkSoftState state, inout LvkSoftPlace place, uint reference) {
    LvkSoftBlocks tlas = LvkSoftBlocks(state.tlas);
    LvkSoftSlabs slabs = lvkSoftSlabsOf(state.origin, state.direction, LVK_SOFT_LEAST);
    vec3 slack = lvkSoftWorldSlack(slabs);
    uint nodes = tlas.at[1].x;
    while ((reference & LVK_SOFT_LEAF) == 0u) {
        uvec2 met = lvkSoftMeet2(slabs, tlas, nodes, reference, vec2(state.tMin, state.committed.t), true, slack);
        if (met.y != LVK_SOFT_NONE) {
            lvkSoftPushReference(place.top, met.y);
        }
        reference = met.x != LVK_SOFT_NONE ? met.x : lvkSoftNextReference(place);
    }
    return reference;
}

// Returns the next instance whose bounds the ray hits, or LVK_SOFT_NONE.
uint lvkSoftNextInstance(LvkSoftState state, inout LvkSoftPlace place) {
    uint reference = lvkSoftNextReference(place);
    if ((reference & LVK_SOFT_LEAF) == 0u) { // otherwise the setup of the ray would be wasted
        reference = lvkSoftDescend(state, place, reference);
    }
    if (reference == LVK_SOFT_NONE) {
        return reference;
    }
    if ((reference & LVK_SOFT_LEAF_COUNT) != 0u) {
        lvkSoftPushReference(place.top, reference + 1u - LVK_SOFT_LEAF_ONE); // the leaf without its first instance
    }
    return reference & LVK_SOFT_LEAF_FIRST;
}

// Moves to the root or part of the next instance that the ray may hit; false if there is none.
bool lvkSoftFindInstance(LvkSoftState state, inout LvkSoftPlace place, out LvkSoftLevel level) {
    if (place.next == LVK_SOFT_NONE && place.top == 0u) {
        return false;
    }
    uvec2 instances = lvkSoftInstances(state);
    uint root = LVK_SOFT_NONE;
    while (root == LVK_SOFT_NONE) {
        place.instance = lvkSoftNextInstance(state, place);
        if (place.instance == LVK_SOFT_NONE) {
            return false;
        }
        root = lvkSoftEnter(state, instances, place.instance, level);
    }
    place.floor = place.top;
    lvkSoftGo(place, root);
    return true;
}

// Traverses the BLAS of a level. Returns true if a candidate waits that the shader must judge.
bool lvkSoftWalkLevel(inout LvkSoftState state, inout LvkSoftPlace place, LvkSoftLevel level) {
    while (true) {
        while (place.leaves.y != 0u) {
            if (lvkSoftTest(state, place, level)) {
                return true;
            }
            if (kLvkSoftIsCpu) { // each iteration tests a primitive or visits a node
                break;
            }
        }
        if (kLvkSoftIsCpu && place.leaves.y != 0u) {
            continue;
        }
        if (place.group.y < LVK_SOFT_ANY_NODE) {
            if (place.top == place.floor) {
                break;
            }
            lvkSoftResume(place, level);
        }
        if (place.group.y >= LVK_SOFT_ANY_NODE) {
            lvkSoftVisit(place, level, vec2(state.tMin, state.committed.t));
        }
    }
    place.instance = LVK_SOFT_NONE;
    return false;
}

// With candidates, a separate traversal would take longer to compile than it saves.
#if defined(LVK_DEVICE_IS_CPU) && defined(LVK_OPAQUE_TRIANGLES_ONLY)
#define LVK_SOFT_HAS_CPU_WALK
#include <lvk/software_cpu_walk.glsl>
#endif

// Traverses the BLAS of the instance. Returns true if a candidate waits that the shader must judge.
bool lvkSoftWalk(inout LvkSoftState state, inout LvkSoftPlace place, LvkSoftLevel level) {
#ifdef LVK_SOFT_HAS_CPU_WALK
    if (level.wide && level.kind == LVK_SOFT_TRIANGLES) {
        lvkSoftWalkTriangles(state, place, level);
        return false;
    }
#endif
    return lvkSoftWalkLevel(state, place, level);
}

// Traverses to the next candidate; false if there is none.
bool lvkSoftProceed(inout LvkSoftState state) {
    state.interrupted = false;
    if (state.tlas == uvec2(0u) || LVK_SOFT_IS_STACKLESS) {
        return false;
    }
    lvkSoftOwner = state.id;
    LvkSoftPlace place = state.place;
    LvkSoftLevel level;
    if (place.instance != LVK_SOFT_NONE) {
        lvkSoftEnter(state, lvkSoftInstances(state), place.instance, level);
    }
    while (place.instance != LVK_SOFT_NONE || lvkSoftFindInstance(state, place, level)) {
        if (lvkSoftWalk(state, place, level)) {
            state.interrupted = true;
            state.place = place;
            return true;
        }
    }
    lvkSoftFinish(state.place);
    return false;
}

#endif
