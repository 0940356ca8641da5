// Parameters and memory of every kernel of a build on the GPU.
#ifndef LVK_GROUP
#define LVK_GROUP 128
#endif
layout(local_size_x = LVK_GROUP) in;

const uint kGroup = LVK_GROUP;
const uint kItems = 8u;               // primitives of an invocation that bounds or sorts them
const uint kBlock = kGroup * kItems;  // those of a workgroup
const uint kNone = 0xffffffffu;
const uint kLeaf = 0x80000000u;

// Kernels whose invocations read writes of others in the same dispatch define this as `coherent`.
#ifndef LVK_SHARED
#define LVK_SHARED
#endif

// Memory by one, three, and four words: fewer accesses are faster to run and to compile.
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Inputs { uint word[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer InputTriples { uvec3 triple[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer InputQuads { uvec4 quad[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) LVK_SHARED buffer Words { uint word[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) LVK_SHARED buffer Corners { vec3 corner[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) LVK_SHARED buffer Triples { uvec3 triple[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) LVK_SHARED buffer Quads { uvec4 quad[]; };

// Formats and leaf kinds, as in the header.
const uint kWide = 0u;
const uint kBinary = 1u;
const uint kTriangles = 0u;
const uint kIndexedTriangles = 1u;
const uint kBoxes = 2u;
const uint kInstances = 3u;
const uint kPackedTriangles = 4u;

struct Job {
    uvec2 inputs;        // geometries, or the records of instances
    uvec2 table;         // BLAS addresses that records refer to by index; 0 if records contain addresses
    uvec2 blob;          // the BLAS or TLAS
    uvec2 scratch;
    uvec2 parents;       // of each node, a word in the scratch memory; during builds, the number of primitives below
    uvec2 binary;        // nodes of two children; in the scratch memory, before decisions, if wide nodes replace them
    uint count;          // primitives of the inputs, inactive ones included
    uint inputCount;     // geometries, or addresses in `table`
    uint leafKind;
    uint lowBits;        // of the second word of a code; 0 for codes of one word
    uint nodes;          // offsets in the BLAS or TLAS, in units of 16 bytes; this one is of its final nodes
    uint primitives;
    uint vertices;
    uint geometries;
    uint vertexCount;    // vertices of the copy that leaves refer to
    uint boxes;          // offsets in the scratch memory, in words: six floats for each primitive or wide node
    uint keys;           // codes and indices of primitives
    uint spareKeys;      // later the clusters of ranges, then the index of the primitive in each slot of the leaves
    uint digits;         // counts of each digit, of each pass and in each block
    uint arrivals;       // a counter for each node; during builds, the end of the range that came first at each gap
    uint nodeCapacity;   // maximum binary nodes of a build, maximum nodes of a refit
    uint reserved;
    uint wideCapacity;   // maximum wide nodes of a build; 0 if nodes stay binary
    uint headerFlags;    // bit 0: every geometry is opaque, bit 1: no geometry is opaque
};

layout(push_constant, scalar) uniform Push {
    uvec2 jobs;
    uint firstJob;
    uint passOrJobs;     // index of the sort pass or of the level, or number of jobs
    uint groupsOfJob;    // workgroups of each job where one dispatch has several jobs
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

// Returns the address of element `index` in an array of elements `stride` bytes apart.
uvec2 element(uvec2 base, uint index, uint stride) {
    uint high, low;
    umulExtended(index, stride, high, low);
    return plus(base, low, high);
}

uvec2 place(uint units) { return plus(job.blob, units << 4, units >> 28); }

uvec2 work(uint words) { return plus(job.scratch, words << 2, words >> 30); }

Words header() { return Words(job.blob); }

// Passes of the sort, by bits of the second words first, then of the first words.
#ifndef LVK_DIGIT_BITS
#define LVK_DIGIT_BITS 8
#endif
const uint kDigitBits = LVK_DIGIT_BITS;

uint lowPasses() { return (job.lowBits + kDigitBits - 1u) / kDigitBits; }

uint passes() { return lowPasses() + 32u / kDigitBits; }

// The words before the counts of digits in blocks: counts in all, for each pass and digit.
const uint kDigitTotals = 8u * 256u;

// Returns the keys before a pass; after the last they are in `keys`.
Words keysBefore(uint pass) { return Words(work((passes() - pass & 1u) != 0u ? job.spareKeys : job.keys)); }

// The scratch memory starts with these words. Bounds are stored as numbers that only grow from 0.
const uint kStateWords = 48u;
const uint kActive = 6u;
const uint kWideNodes = 8u;  // exceeds the capacity if the nodes did not fit
const uint kEnds = 9u;       // for each level, the index after its last wide node

Words state() { return Words(job.scratch); }

void readJob(uint number) {
    InputQuads from = InputQuads(element(jobs, number, kJobBytes));
    uvec4 a = from.quad[0], b = from.quad[1], c = from.quad[2], d = from.quad[3];
    uvec4 e = from.quad[4], f = from.quad[5], g = from.quad[6], h = from.quad[7];
    job = Job(a.xy, a.zw, b.xy, b.zw, c.xy, c.zw, d.x, d.y, d.z, d.w, e.x, e.y, e.z, e.w, f.x, f.y, f.z, f.w, g.x, g.y,
              g.z, g.w, h.x, h.y);
}
