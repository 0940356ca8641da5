#ifndef LVK_SOFTWARE_TRAVERSAL_GLSL
#define LVK_SOFTWARE_TRAVERSAL_GLSL

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
struct LvkSoftCursor {
    uint next;     // reference of the TLAS to visit before those on the stack, or LVK_SOFT_NONE
    uint instance; // instance whose BLAS is traversed, or LVK_SOFT_NONE
    uvec2 group;   // nodes: a group of lvkSoftIntersect8, or the index of a binary node and LVK_SOFT_ONE_NODE
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
    LvkSoftCursor cursor;
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

// A step of the traversal: a node that a ray visits, or a primitive that it tests.
#ifdef LVK_COUNT_TRAVERSAL_STEPS
#define LVK_SOFT_COUNT_STEP() lvkTraversalSteps += 1u
#else
#define LVK_SOFT_COUNT_STEP()
#endif

// Constants, so that compilers remove the code that a module without candidates or without AABBs does not need.
#ifdef LVK_LOWERED_PIPELINE
const bool kLvkSoftHasCandidates = kLvkHasCandidates;
const bool kLvkSoftHasBoxes = kLvkHasBoxes;
#define LVK_SOFT_MAY_LACK_CANDIDATES
#else
#ifdef LVK_OPAQUE_TRIANGLES_ONLY
const bool kLvkSoftHasCandidates = false;
#define LVK_SOFT_MAY_LACK_CANDIDATES
#else
const bool kLvkSoftHasCandidates = true;
#endif
#ifdef LVK_TRIANGLES_ONLY
const bool kLvkSoftHasBoxes = false;
#else
const bool kLvkSoftHasBoxes = true;
#endif
#endif

#ifdef LVK_CANDIDATE_FUNCTION
// Calls the function of the module. The cursor of the state may be finished afterwards.
void lvkSoftCallCandidateFunction(inout LvkSoftState state);
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
void lvkSoftMoveTo(inout LvkSoftCursor cursor, uint reference) {
    bool isLeaf = (reference & LVK_SOFT_LEAF) != 0u;
    uint count = (reference & LVK_SOFT_LEAF_COUNT) / LVK_SOFT_LEAF_ONE + 1u;
    cursor.group = isLeaf ? uvec2(0u) : uvec2(reference, LVK_SOFT_ONE_NODE);
    cursor.leaves = isLeaf ? uvec2(reference & LVK_SOFT_LEAF_FIRST, (1u << count) - 1u) : uvec2(0u);
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
    return lvkSoftOffsetAddress(state.tlas, LvkSoftBlocks(state.tlas).at[1].y);
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
    uvec4 offsets = lvkSoftBlock(LvkSoftBlocks(level.structure), 1u);
    uvec4 counts = lvkSoftBlock(LvkSoftBlocks(level.structure), 2u);
    uint flags = numbers.w >> 24;
    level.wide = head.x == LVK_SOFT_WIDE;
    level.several = counts.y > 1u;
    level.kind = head.y;
    level.opacity = lvkSoftOpacity(counts.w, flags, state.flags);
    level.cull = (flags & LVK_SOFT_NO_CULL) != 0u ? 0u : state.flags & LVK_SOFT_CULL_FACES;
    level.flip = (flags & LVK_SOFT_FLIP_FACING) != 0u;
    level.nodes = offsets.x;
    level.primitives = offsets.y;
    level.slabs = lvkSoftSlabsOf(origin, direction, lvkSoftLeast(level.structure, origin, direction));
    level.shear = lvkSoftShearOf(direction);
    bool isBox = level.kind == LVK_SOFT_BOXES;
    uint skip = isBox ? LVK_RAY_FLAG_SKIP_AABBS : LVK_RAY_FLAG_SKIP_TRIANGLES;
    bool skipped = (state.flags & skip) != 0u || (isBox && !kLvkSoftHasBoxes);
    bool culled = level.opacity != LVK_SOFT_EACH && lvkSoftIsCulled(state.flags, level.opacity == LVK_SOFT_OPAQUE);
    // The entry point is a part of the BLAS. A moved BLAS has other parts, and is entered at its root.
    uint start = entry != 0u && level.structure == numbers.xy ? entry : head.z;
    return culled || skipped ? LVK_SOFT_NONE : start;
}

// Removes the next node of a wide tree from the group.
uint lvkSoftTakeNode(inout LvkSoftCursor cursor, LvkSoftLevel level) {
    uint bit = uint(findMSB(cursor.group.y));
    uint slot = bit - 24u ^ level.slabs.octant;
    uint before = bitCount(cursor.group.y & 0xFFu & (1u << slot) - 1u);
    cursor.group.y ^= 1u << bit;
    return cursor.group.x + before;
}

// Visits the next node of the group.
void lvkSoftVisit(inout LvkSoftCursor cursor, LvkSoftLevel level, vec2 range) {
    LVK_SOFT_COUNT_STEP();
    if (level.wide) {
        uint node = lvkSoftTakeNode(cursor, level);
        if (cursor.group.y >= LVK_SOFT_ANY_NODE) {
            lvkSoftPushGroup(cursor.top, cursor.group);
        }
        uvec4 hits = lvkSoftIntersect8(level.slabs, level.structure, level.nodes, node, range);
        cursor.group = hits.xy;
        cursor.leaves = hits.zw;
    } else {
        uvec2 hits = lvkSoftIntersect2(level.slabs, LvkSoftBlocks(level.structure), level.nodes, cursor.group.x, range,
                                       false, vec3(0.0));
        cursor.group = uvec2(0u);
        if (hits.y != LVK_SOFT_NONE) {
            lvkSoftPushReference(cursor.top, hits.y);
        }
        if (hits.x != LVK_SOFT_NONE) {
            lvkSoftMoveTo(cursor, hits.x);
        }
    }
}

// Pops the last entry that this level has pushed.
void lvkSoftResume(inout LvkSoftCursor cursor, LvkSoftLevel level) {
    uvec2 entry = lvkSoftPop(cursor.top, level.wide);
    if (level.wide) {
        cursor.group = entry;
    } else {
        lvkSoftMoveTo(cursor, entry.x);
    }
}

LvkSoftHit lvkSoftNoHit(float t) {
    return LvkSoftHit(t, 0u, LVK_SOFT_NONE, 0u, uvec2(0u), vec2(0.0), false, false);
}

// Ends the traversal.
void lvkSoftFinish(inout LvkSoftCursor cursor) {
    cursor = LvkSoftCursor(LVK_SOFT_NONE, LVK_SOFT_NONE, uvec2(0u), uvec2(0u), 0u, 0u);
}

// Commits a hit; ends the traversal if that is enough.
void lvkSoftCommit(inout LvkSoftState state, inout LvkSoftCursor cursor, LvkSoftHit hit, uint kind) {
    state.committed = hit;
    state.committed.kind = kind;
    if ((state.flags & LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT) != 0u) {
        lvkSoftFinish(cursor);
    }
}

// Returns the vertex indices of a triangle, and the word with its ids.
uvec4 lvkSoftVertexIndices(uvec2 structure, uint primitives, uint kind, uint primitive) {
    if (kind == LVK_SOFT_INDEXED) {
        return LvkSoftBlocks(structure).at[primitives + primitive];
    }
    uvec3 leaf = LvkSoftTriples(lvkSoftOffsetAddress(structure, primitives)).at[primitive];
    uvec2 rest = leaf.xy >> LVK_SOFT_INDEX_BITS;
    return uvec4(leaf.xy & LVK_SOFT_INDEX_MASK, rest.x | rest.y << LVK_SOFT_REST_BITS, leaf.z);
}

// Returns the vertices of a triangle whose leaf starts at block `first`. `words` are the other words of the leaf.
void lvkSoftReadTriangle(LvkSoftBlocks blocks, uint first, out vec3 vertices[3], out uvec3 words) {
    uvec4 a = lvkSoftBlock(blocks, first);
    uvec4 b = lvkSoftBlock(blocks, first + 1u);
    uvec4 c = lvkSoftBlock(blocks, first + 2u);
    vertices[0] = uintBitsToFloat(a.xyz);
    vertices[1] = uintBitsToFloat(b.xyz);
    vertices[2] = uintBitsToFloat(c.xyz);
    words = uvec3(a.w, b.w, c.w);
}

// Like lvkSoftReadTriangle, for any kind of leaf.
void lvkSoftReadVertices(uvec2 structure, uint primitives, uint kind, uint primitive, out vec3 vertices[3],
                         out uvec3 words) {
    LvkSoftBlocks blocks = LvkSoftBlocks(structure);
    if (kind != LVK_SOFT_TRIANGLES) {
        uvec4 indices = lvkSoftVertexIndices(structure, primitives, kind, primitive);
        uvec2 points = lvkSoftOffsetAddress(structure, blocks.at[1].z);
        vertices[0] = LvkSoftVertices(points).at[indices.x];
        vertices[1] = LvkSoftVertices(points).at[indices.y];
        vertices[2] = LvkSoftVertices(points).at[indices.z];
        words = uvec3(indices.w, 0u, 0u);
    } else {
        uint first = lvkSoftBegin(blocks, primitives + primitive * LVK_SOFT_TRIANGLE_BLOCKS);
        lvkSoftReadTriangle(blocks, first, vertices, words);
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
    uvec2 geometries = lvkSoftOffsetAddress(level.structure, LvkSoftBlocks(level.structure).at[1].w);
    return (LvkSoftBlocks(geometries).at[hit.numbers.x].x & 1u) != 0u;
}

// Returns true if the ray hits or touches an AABB primitive. An AABB with swapped minimum and maximum is empty.
bool lvkSoftHitsAabb(LvkSoftState state, LvkSoftLevel level, inout LvkSoftHit hit) {
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
    vec3 vertices[3];
    uvec3 words;
    lvkSoftReadVertices(level.structure, level.primitives, level.kind, hit.primitive, vertices, words);
    LvkSoftPassage passage;
    if (!lvkSoftPasses(level.shear, level.slabs.origin, vertices, passage)) {
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

// Hands the candidate to the shader: to its function if it has one, else by ending the call to lvkSoftProceed. Returns
// true for the latter.
bool lvkSoftHandOver(inout LvkSoftState state, inout LvkSoftCursor cursor) {
#ifdef LVK_CANDIDATE_FUNCTION
    state.cursor = cursor;
    lvkSoftCallCandidateFunction(state);
    cursor = state.cursor;
    return false;
#else
    return true;
#endif
}

// Tests the next primitive. Returns true if it is a candidate that waits for the shader.
bool lvkSoftTest(inout LvkSoftState state, inout LvkSoftCursor cursor, LvkSoftLevel level) {
    LVK_SOFT_COUNT_STEP();
    uint primitive = cursor.leaves.x + uint(findLSB(cursor.leaves.y));
    cursor.leaves.y &= cursor.leaves.y - 1u;
    bool isBox = kLvkSoftHasBoxes && level.kind == LVK_SOFT_BOXES;
    LvkSoftHit hit = lvkSoftNoHit(0.0);
    hit.instance = cursor.instance;
    hit.primitive = primitive;
    bool isHit = isBox ? lvkSoftHitsAabb(state, level, hit) : lvkSoftHitsTriangle(state, level, hit);
    if (!isHit) {
        return false;
    }
    if (!kLvkSoftHasCandidates) {
        lvkSoftCommit(state, cursor, hit, 1u);
        return false;
    }
    hit.opaque = level.opacity == LVK_SOFT_EACH ? lvkSoftSaysOpaque(level, hit) : level.opacity == LVK_SOFT_OPAQUE;
    if (lvkSoftIsCulled(state.flags, hit.opaque)) {
        return false;
    }
    if (hit.opaque && !isBox) {
        lvkSoftCommit(state, cursor, hit, 1u);
        return false;
    }
    state.candidate = hit;
    state.candidate.kind = isBox ? LVK_SOFT_CANDIDATE_BOX : LVK_SOFT_CANDIDATE_TRIANGLE;
    return lvkSoftHandOver(state, cursor);
}

// Returns the next reference of the TLAS; LVK_SOFT_NONE if none is left.
uint lvkSoftNextReference(inout LvkSoftCursor cursor) {
    uint next = cursor.next;
    cursor.next = LVK_SOFT_NONE;
    return next != LVK_SOFT_NONE || cursor.top == 0u ? next : lvkSoftPopReference(cursor.top);
}

// Returns the next leaf of the TLAS that the ray hits, from a node on; LVK_SOFT_NONE if none is left.
uint lvkSoftDescend(LvkSoftState state, inout LvkSoftCursor cursor, uint reference) {
    LvkSoftBlocks tlas = LvkSoftBlocks(state.tlas);
    LvkSoftSlabs slabs = lvkSoftSlabsOf(state.origin, state.direction, LVK_SOFT_LEAST);
    vec3 slack = lvkSoftWorldSlack(slabs);
    uint nodes = tlas.at[1].x;
    while ((reference & LVK_SOFT_LEAF) == 0u) {
        LVK_SOFT_COUNT_STEP();
        uvec2 hits = lvkSoftIntersect2(slabs, tlas, nodes, reference, vec2(state.tMin, state.committed.t), true, slack);
        if (hits.y != LVK_SOFT_NONE) {
            lvkSoftPushReference(cursor.top, hits.y);
        }
        reference = hits.x != LVK_SOFT_NONE ? hits.x : lvkSoftNextReference(cursor);
    }
    return reference;
}

// Returns the next instance whose bounds the ray hits, or LVK_SOFT_NONE.
uint lvkSoftNextInstance(LvkSoftState state, inout LvkSoftCursor cursor) {
    uint reference = lvkSoftNextReference(cursor);
    if ((reference & LVK_SOFT_LEAF) == 0u) { // otherwise the setup of the ray would be wasted
        reference = lvkSoftDescend(state, cursor, reference);
    }
    if (reference == LVK_SOFT_NONE) {
        return reference;
    }
    if ((reference & LVK_SOFT_LEAF_COUNT) != 0u) {
        lvkSoftPushReference(cursor.top, reference + 1u - LVK_SOFT_LEAF_ONE); // the leaf without its first instance
    }
    return reference & LVK_SOFT_LEAF_FIRST;
}

// Moves to the root or part of the next instance that the ray may hit; false if there is none.
bool lvkSoftFindInstance(LvkSoftState state, inout LvkSoftCursor cursor, out LvkSoftLevel level) {
    if (cursor.next == LVK_SOFT_NONE && cursor.top == 0u) {
        return false;
    }
    uvec2 instances = lvkSoftInstances(state);
    uint root = LVK_SOFT_NONE;
    while (root == LVK_SOFT_NONE) {
        cursor.instance = lvkSoftNextInstance(state, cursor);
        if (cursor.instance == LVK_SOFT_NONE) {
            return false;
        }
        root = lvkSoftEnter(state, instances, cursor.instance, level);
    }
    cursor.floor = cursor.top;
    lvkSoftMoveTo(cursor, root);
    return true;
}

// Traverses the BLAS of a level. Returns true if a candidate waits that the shader must judge.
bool lvkSoftTraverseLevel(inout LvkSoftState state, inout LvkSoftCursor cursor, LvkSoftLevel level) {
    while (true) {
        while (cursor.leaves.y != 0u) {
            if (lvkSoftTest(state, cursor, level)) {
                return true;
            }
            if (kLvkSoftIsCpu) { // each iteration tests a primitive or visits a node
                break;
            }
        }
        if (kLvkSoftIsCpu && cursor.leaves.y != 0u) {
            continue;
        }
        if (cursor.group.y < LVK_SOFT_ANY_NODE) {
            if (cursor.top == cursor.floor) {
                break;
            }
            lvkSoftResume(cursor, level);
        }
        if (cursor.group.y >= LVK_SOFT_ANY_NODE) {
            lvkSoftVisit(cursor, level, vec2(state.tMin, state.committed.t));
        }
    }
    cursor.instance = LVK_SOFT_NONE;
    return false;
}

// With candidates, a separate traversal would take longer to compile than it saves.
#if defined(LVK_DEVICE_IS_CPU) && defined(LVK_SOFT_MAY_LACK_CANDIDATES)
#define LVK_SOFT_HAS_CPU_TRAVERSAL
#include <lvk/software_cpu_traversal.glsl>
#endif

// Traverses the BLAS of the instance. Returns true if a candidate waits that the shader must judge.
bool lvkSoftTraverse(inout LvkSoftState state, inout LvkSoftCursor cursor, LvkSoftLevel level) {
#ifdef LVK_SOFT_HAS_CPU_TRAVERSAL
    if (!kLvkSoftHasCandidates && level.wide && level.kind == LVK_SOFT_TRIANGLES) {
        lvkSoftTraverseTriangles(state, cursor, level);
        return false;
    }
#endif
    return lvkSoftTraverseLevel(state, cursor, level);
}

// Traverses to the next candidate; false if there is none.
bool lvkSoftProceed(inout LvkSoftState state) {
    state.interrupted = false;
    if (state.tlas == uvec2(0u) || LVK_SOFT_IS_STACKLESS) {
        return false;
    }
    lvkSoftOwner = state.id;
    LvkSoftCursor cursor = state.cursor;
    LvkSoftLevel level;
    if (cursor.instance != LVK_SOFT_NONE) {
        lvkSoftEnter(state, lvkSoftInstances(state), cursor.instance, level);
    }
    while (cursor.instance != LVK_SOFT_NONE || lvkSoftFindInstance(state, cursor, level)) {
        if (lvkSoftTraverse(state, cursor, level)) {
            state.interrupted = true;
            state.cursor = cursor;
            return true;
        }
    }
    lvkSoftFinish(state.cursor);
    return false;
}

#endif
