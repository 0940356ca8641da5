// Writes the addresses of BLASes into instances that name them by entry, and the hit remap entry of each instance: the
// map of its primitives and the caller's instance. An entry that does not exist becomes an instance that no ray hits.
layout(local_size_x = 64) in;

struct Entry { uint first; uint count; };
struct Part { uvec2 structure; uvec2 map; };
struct Instance { uvec4 rows[3]; uvec2 numbers; uvec2 structure; };
struct Row { uvec2 map; uint instance; uint unused; };

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer Entries { Entry entry[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer Parts { Part part[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Owners { uint owner[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Source { Instance instance[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) writeonly buffer Target { Instance instance[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) writeonly buffer Rows { Row row[]; };

layout(push_constant, scalar) uniform Push {
    Source source;
    Target target;
    uvec2 rows;        // hit remap table; 0 without one
    Entries entries;
    Parts parts;
    uvec2 owners;      // of the instances after the caller's; 0 without such instances
    uint count;        // instances in `source`
    uint copies;       // maximum parts of an entry; copy p of the list has part p
    uint entryCount;
    uint userCount;
    uint keepActive;   // not 0: copies without a part of their own stay in the tree, but no ray hits them
};

// Keeps the custom index and clears the mask above it: no ray has a bit in common with 0.
const uint kNoMask = 0x00ffffffu;

void main() {
    uint i = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * gl_NumWorkGroups.x * gl_WorkGroupSize.x;
    if (i >= count * copies) return;
    uint copy = i / count;
    uint from = i % count;
    Instance instance = source.instance[from];
    uint entry = instance.structure.x;
    Part part = Part(uvec2(0), uvec2(0));
    if (entry < entryCount && instance.structure.y == 0u) {
        Entry found = entries.entry[entry];
        if (copy < found.count) {
            part = parts.part[found.first + copy];
        } else if (keepActive != 0u && found.count > 0u) {
            part = parts.part[found.first];
            instance.numbers.x &= kNoMask;
        }
    }
    instance.structure = part.structure;
    target.instance[i] = instance;
    if (rows != uvec2(0)) {
        uint owner = from < userCount ? from : Owners(owners).owner[from - userCount];
        Rows(rows).row[i] = Row(part.map, owner, 0u);
    }
}
