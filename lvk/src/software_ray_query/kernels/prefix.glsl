// The implicit hierarchy of sorted codes: a range of leaves is split where the highest bit of their codes changes.
// Leaves with equal codes differ by their indices.
uint leafReference(uint leaf) { return kLeaf | Words(work(job.keys)).word[job.count + leaf]; }

// Returns the number of leading bits that the codes of two leaves share. A range whose ends share `n` bits has at most
// `n` ranges above it.
uint sharedBits(uint one, uint other) {
    Words keys = Words(work(job.keys));
    uint changed = keys.word[one] ^ keys.word[other];
    if (changed != 0u) return uint(29 - findMSB(changed));
    uint before = 30u + job.lowBits;
    if (job.lowBits != 0u) {
        changed = keys.word[2 * job.count + one] ^ keys.word[2 * job.count + other];
        if (changed != 0u) return before - 1u - uint(findMSB(changed));
    }
    return before + uint(findMSB(job.count - 1u)) - uint(findMSB(one ^ other));
}
