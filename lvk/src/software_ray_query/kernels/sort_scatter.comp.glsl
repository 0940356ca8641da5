// Sorts the keys of a block by their digit, first by its low and then by its high half, and moves them to their
// positions among all keys.

// The digit (16 bits above) and the place in the block of each key.
shared uint items[kBlock];
// The position of the first key of each digit, less its place in the sorted block.
shared uint start[kDigits];

// Sorts the items by four bits.
void sortItems(uint shift) {
    uint first = gl_LocalInvocationIndex * kItems;
    uint own[kItems];
    resetCounts();
    [[unroll]] for (uint k = 0; k < kItems; ++k) {
        own[k] = items[first + k];
        countOne(own[k] >> shift & 15u);
    }
    rankFirsts();
    [[unroll]] for (uint k = 0; k < kItems; ++k) items[nextRank(own[k] >> shift & 15u)] = own[k];
    barrier();
}

void main() {
    readJob(firstJob);
    uint blocks = (job.count + kBlock - 1) / kBlock;
    uint block = groupNumber();
    if (block >= blocks) return;
    uint t = gl_LocalInvocationIndex;
    uint keys = min(kBlock, job.count - block * kBlock);
    Source from = sourceOf(passOrJobs);
    [[dont_unroll]] for (uint i = t; i < kBlock; i += kGroup) {
        items[i] = i < keys ? digitOf(from, block * kBlock + i) << 16 | i : kNone;
    }
    barrier();
    sortItems(16u);
    sortItems(20u);
    Words table = Words(work(job.digits));
    [[dont_unroll]] for (uint i = t; i < keys; i += kGroup) {
        uint digit = items[i] >> 16;
        if (i == 0u || items[i - 1u] >> 16 != digit) start[digit] = table.word[kDigitTotals + digit * blocks + block] - i;
    }
    barrier();
    Words to = targetOf(passOrJobs);
    [[dont_unroll]] for (uint i = t; i < keys; i += kGroup) {
        uint item = items[i];
        moveKey(from, to, block * kBlock + (item & 0xffffu), start[item >> 16] + i);
    }
}
