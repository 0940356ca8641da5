// Keys and their digits: words of a code, sorted by kDigitBits bits a pass, stably.
const uint kDigits = 1u << kDigitBits;

struct Source { Words keys; uint digitWord; uint shift; };

// Returns the key word and the bits that a pass sorts by; the low words come first.
Source sourceOf(uint pass) {
    bool low = pass < lowPasses();
    return Source(keysBefore(pass), low ? 2 * job.count : 0u, (low ? pass : pass - lowPasses()) * kDigitBits);
}

Words targetOf(uint pass) { return keysBefore(pass + 1u); }

uint digitOf(Source from, uint i) { return from.keys.word[from.digitWord + i] >> from.shift & (kDigits - 1); }

void moveKey(Source from, Words to, uint i, uint rank) {
    to.word[rank] = from.keys.word[i];
    to.word[job.count + rank] = from.keys.word[job.count + i];
    if (job.lowBits != 0u) to.word[2 * job.count + rank] = from.keys.word[2 * job.count + i];
}
