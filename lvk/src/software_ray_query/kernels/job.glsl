// What every kernel of a build on the GPU works on.
layout(local_size_x = 128) in;

const uint kGroup = 128u;
const uint kItems = 8u;               // keys that an invocation sorts
const uint kBlock = kGroup * kItems;  // keys that a workgroup sorts
const uint kNone = 0xffffffffu;
const uint kLeaf = 0x80000000u;

// Kernels whose invocations read what others of the same dispatch wrote say `coherent` here.
#ifndef LVK_SHARED
#define LVK_SHARED
#endif

// Memory by words, by three, and by four at a time: fewer accesses are faster to run and to compile.
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Inputs { uint word[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer InputTriples { uvec3 triple[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer InputQuads { uvec4 quad[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) LVK_SHARED buffer Words { uint word[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) LVK_SHARED buffer Corners { vec3 corner[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) LVK_SHARED buffer Triples { uvec3 triple[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) LVK_SHARED buffer Quads { uvec4 quad[]; };

// Formats and leaf kinds as the header has them.
const uint kWide = 0u;
const uint kBinary = 1u;
const uint kTriangles = 0u;
const uint kIndexedTriangles = 1u;
const uint kBoxes = 2u;
const uint kInstances = 3u;
const uint kPackedTriangles = 4u;

struct Job {
    uvec2 inputs;        // geometries, or the records of instances
    uvec2 table;         // addresses of structures that records name by place; 0 where they hold addresses
    uvec2 blob;          // the structure
    uvec2 scratch;
    uvec2 parents;       // of each node, a word in the scratch memory
    uvec2 binary;        // nodes of two children: of what ends with wide nodes in the scratch memory
    uint count;          // primitives of the inputs, inactive ones included
    uint inputCount;     // geometries, or addresses in `table`
    uint leafKind;
    uint lowBits;        // of the second word of a code; 0 where codes have but one
    uint nodes;          // places in the structure, in units of 16 bytes; these are of the nodes it ends with
    uint primitives;
    uint vertices;
    uint geometries;
    uint vertexCount;    // vertices of the copy that leaves name
    uint boxes;          // places in the scratch memory, in words: six floats for each primitive or wide node
    uint keys;           // codes and numbers of primitives
    uint spareKeys;      // afterwards the number of the primitive in each slot of the leaves
    uint digits;         // how often each digit occurs in each block
    uint arrivals;       // a counter for each node
    uint nodeCapacity;   // most binary nodes of a build, most nodes of a refit
    uint improvements;   // how often places are made better
    uint wideCapacity;   // most wide nodes of a build; 0 where nodes stay binary
    uint headerFlags;    // bit 0: every geometry is opaque, bit 1: none is
};

layout(push_constant, scalar) uniform Push {
    uvec2 jobs;
    uint firstJob;
    uint passOrJobs;     // which pass of the sort, or how many jobs there are with a workgroup each
};

const uint kJobBytes = 128u;

Job job;

uint groupNumber() { return gl_WorkGroupID.x + gl_WorkGroupID.y * gl_NumWorkGroups.x; }

uint invocation() { return groupNumber() * kGroup + gl_LocalInvocationIndex; }

uvec2 plus(uvec2 address, uint low, uint high) {
    uint carry;
    uint sum = uaddCarry(address.x, low, carry);
    return uvec2(sum, address.y + high + carry);
}

// Element `index` of an array of elements `stride` bytes apart.
uvec2 element(uvec2 base, uint index, uint stride) {
    uint high, low;
    umulExtended(index, stride, high, low);
    return plus(base, low, high);
}

uvec2 place(uint units) { return plus(job.blob, units << 4, units >> 28); }

uvec2 work(uint words) { return plus(job.scratch, words << 2, words >> 30); }

Words header() { return Words(job.blob); }

// Passes of the sort: four bits each, the second words first, then 31 bits of the first words.
uint lowPasses() { return (job.lowBits + 3) / 4; }

uint passes() { return lowPasses() + 8; }

// Where keys lie before a pass; after the last they are in `keys`.
Words keysBefore(uint pass) { return Words(work((passes() - pass & 1u) != 0u ? job.spareKeys : job.keys)); }

// The scratch memory starts with these words. Bounds are kept as numbers that only grow from 0.
const uint kStateWords = 48u;
const uint kActive = 6u;
const uint kPlaced = 7u;     // slots of leaves that have a primitive
const uint kWideNodes = 8u;  // more than there is room for where they did not fit
const uint kEnds = 9u;       // of each level the number behind its last wide node

Words state() { return Words(job.scratch); }

void readJob(uint number) {
    InputQuads from = InputQuads(element(jobs, number, kJobBytes));
    uvec4 a = from.quad[0], b = from.quad[1], c = from.quad[2], d = from.quad[3];
    uvec4 e = from.quad[4], f = from.quad[5], g = from.quad[6], h = from.quad[7];
    job = Job(a.xy, a.zw, b.xy, b.zw, c.xy, c.zw, d.x, d.y, d.z, d.w, e.x, e.y, e.z, e.w, f.x, f.y, f.z, f.w, g.x, g.y,
              g.z, g.w, h.x, h.y);
}
