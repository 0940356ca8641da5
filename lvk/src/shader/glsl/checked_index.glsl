// Checks indices of bindless arrays before they are used. `lvk/src/bindless/index_checks.rs` has the layout of the words.
layout(local_size_x = 1) in;

layout(buffer_reference, std430, buffer_reference_align = 4) buffer LvkCheckWords { uint at[]; };

const uint CURRENT = 0u;
const uint LOST = 1u;
const uint COMMAND = 2u;
const uint ENTRIES = 16u;
const uint ENTRY_COUNT = 4096u;
const uint ENTRY_WORDS = 8u;
const uint PROBES = 16u;

// Returns the index. If no live object has the index, records the access and returns 0. `declarations` is the position
// of the declarations of textures, or 0. `writes` is 1 for an access that writes. The lowest bit of a declaration tells that
// a command has written the texture; the others are the number of the command that declared it. The library links this
// function alone.
uint lvkCheckedIndex(const uvec2 address, const uint shader, const uint array, const uint first, const uint count,
                     const uint declarations, const uint writes, const uint index) {
    LvkCheckWords words = LvkCheckWords(address);
    uint last = 0u;
    if (index < count) {
        last = words.at[first + index];
    }
    uint result = 0u;
    if (words.at[CURRENT] <= last) {
        if (declarations == 0u) {
            return index;
        }
        uint declaration = words.at[declarations + index];
        if (declaration >> 1 == words.at[COMMAND] || (declaration & 1u | writes) == 0u) {
            return index;
        }
        result = index;
        last = 0xFFFFFFFFu;
    }
    uint key = ((index * 0x9E3779B9u ^ shader) * 0x85EBCA6Bu ^ array * 0xC2B2AE35u) * 0x27D4EB2Fu;
    key = (key ^ key >> 15) | 1u;
    for (uint probe = 0u; probe < PROBES; ++probe) {
        uint entry = ENTRIES + ((key >> 1) + probe) % ENTRY_COUNT * ENTRY_WORDS;
        uint found = atomicCompSwap(words.at[entry], 0u, key);
        if (found == 0u || found == key) {
            words.at[entry + 1u] = shader;
            words.at[entry + 2u] = array;
            words.at[entry + 3u] = index;
            words.at[entry + 4u] = last;
            atomicAdd(words.at[entry + 5u], 1u);
            return result;
        }
    }
    atomicAdd(words.at[LOST], 1u);
    return result;
}

// The compiler emits only functions that are called.
shared uint checkedIndex;

void main() { checkedIndex = lvkCheckedIndex(uvec2(0u), 0u, 0u, 0u, 0u, 0u, 0u, 0u); }
