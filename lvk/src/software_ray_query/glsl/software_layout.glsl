#ifndef LVK_SOFTWARE_LAYOUT_GLSL
#define LVK_SOFTWARE_LAYOUT_GLSL

// Memory layout of BLASes and TLASes; the same numbers as in lvk/src/software_ray_query/layout.rs. Everything is read
// in blocks of 16 bytes by address. The header has the offsets of the parts in blocks from its own start.
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer LvkSoftBlocks { uvec4 at[]; };
#ifdef LVK_GATHERS_PAIRS
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer LvkSoftPairs { u64vec2 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer LvkSoftPair { uint64_t at; };
#endif
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LvkSoftVertices { vec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LvkSoftTriples { uvec3 at[]; };

// Format of a BLAS or TLAS: block 0 is (format, kind of leaves, root, number of primitives). In a moved BLAS, the last
// two are the address of the target BLAS.
#define LVK_SOFT_WIDE 0u
#define LVK_SOFT_BINARY 1u
#define LVK_SOFT_MOVED 2u

// Kinds of leaves.
#define LVK_SOFT_TRIANGLES 0u
#define LVK_SOFT_INDEXED 1u
#define LVK_SOFT_BOXES 2u
#define LVK_SOFT_INSTANCES 3u
#define LVK_SOFT_PACKED 4u

// Node references: the index of a node. With the highest bit, a leaf: first primitive, and 4 bits for the count minus
// 1.
#define LVK_SOFT_LEAF 0x80000000u
#define LVK_SOFT_LEAF_COUNT 0x78000000u
#define LVK_SOFT_LEAF_ONE 0x08000000u
#define LVK_SOFT_LEAF_FIRST 0x07FFFFFFu
#define LVK_SOFT_NONE 0xFFFFFFFFu

// Marks of a BLAS, in the last word of block 2.
#define LVK_SOFT_ALL_OPAQUE 1u
#define LVK_SOFT_NONE_OPAQUE 2u

// Flags of an instance, in the highest byte of the last word of its block 6.
#define LVK_SOFT_NO_CULL 1u
#define LVK_SOFT_FLIP_FACING 2u
#define LVK_SOFT_FORCE_OPAQUE 4u
#define LVK_SOFT_FORCE_NO_OPAQUE 8u

#define LVK_SOFT_INSTANCE_BLOCKS 8u
#define LVK_SOFT_TRIANGLE_BLOCKS 3u
#define LVK_SOFT_BOX_BLOCKS 2u
#define LVK_SOFT_BINARY_NODE_BLOCKS 4u
#define LVK_SOFT_WIDE_NODE_BLOCKS 5u

// Packed leaves: bits of a vertex index in its own word, and of the third index above it.
#define LVK_SOFT_INDEX_BITS 21
#define LVK_SOFT_REST_BITS 11
#define LVK_SOFT_INDEX_MASK 0x001FFFFFu

// On CPUs, loops and branches cost more than idle invocations.
#ifdef LVK_DEVICE_IS_CPU
const bool kLvkSoftIsCpu = true;
#else
const bool kLvkSoftIsCpu = false;
#endif

// A path has at most 64 binary nodes in either level, or 32 wide ones, and each pushes one entry. An instance can push
// another entry for its leaf. On CPUs, a binary node pushes half an entry.
#ifdef LVK_DEVICE_IS_CPU
#define LVK_SOFT_STACK_ENTRIES 66u
#else
#define LVK_SOFT_STACK_ENTRIES 130u
#endif

// Returns a block of a node or leaf.
uvec4 lvkSoftBlock(LvkSoftBlocks blocks, uint at) {
#ifdef LVK_GATHERS_PAIRS
    u64vec2 pairs = LvkSoftPairs(uvec2(blocks)).at[at];
    return uvec4(unpackUint2x32(pairs.x), unpackUint2x32(pairs.y));
#else
    return blocks.at[at];
#endif
}

// Returns the index of the first block of several to read. With 64-bit address arithmetic, `blocks` starts at it
// afterwards, so that one address serves all of them.
uint lvkSoftBegin(inout LvkSoftBlocks blocks, uint first) {
#ifdef LVK_GATHERS_PAIRS
    blocks = LvkSoftBlocks(unpackUint2x32(packUint2x32(uvec2(blocks)) + uint64_t(first) * 16ul));
    return 0u;
#else
    return first;
#endif
}

// Returns the address `blocks` blocks after another one.
uvec2 lvkSoftOffsetAddress(uvec2 base, uint blocks) {
    uint carry;
    uint low = uaddCarry(base.x, blocks << 4, carry);
    return uvec2(low, base.y + (blocks >> 28) + carry);
}

// The address of the first node or primitive, from which that of another one is computed.
#ifdef LVK_GATHERS_PAIRS
#define LvkSoftItems uint64_t
LvkSoftItems lvkSoftItems(uvec2 structure, uint first) {
    return packUint2x32(structure) + uint64_t(first) * 16ul;
}

LvkSoftBlocks lvkSoftItem(LvkSoftItems items, uint item, uint blocks) {
    return LvkSoftBlocks(unpackUint2x32(items + uint64_t(item) * uint64_t(blocks * 16u)));
}
#else
#define LvkSoftItems uvec2
LvkSoftItems lvkSoftItems(uvec2 structure, uint first) {
    return lvkSoftOffsetAddress(structure, first);
}

LvkSoftBlocks lvkSoftItem(LvkSoftItems items, uint item, uint blocks) {
    return LvkSoftBlocks(lvkSoftOffsetAddress(items, item * blocks));
}
#endif

#endif
