// Counts of the children that arrived at each node. Fitting starts where both children are leaves, which has to be known
// beforehand: others may change a node before its own invocation looks at it.
const uint kStart = 0x80000000u;

void resetArrivals(uint node) {
    Words at = Words(plus(place(job.nodes), node << 6, node >> 26));
    bool start = (at.word[3] & at.word[7] & kLeaf) != 0u;
    Words(work(job.arrivals)).word[node] = start ? kStart : 0u;
}
