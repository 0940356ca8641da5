// Writes the parent of a node, and its child index there.
void writeParent(uint child, uint parent, uint which) { Words(job.parents).word[child] = parent | which << 29; }

// Counters of the children that arrived at each node. Fitting starts at nodes whose children are both leaves. These are
// marked in advance: other invocations may change a node before its own invocation reads it.
const uint kStart = 0x80000000u;

void writeArrivals(uint node, bool start) { Words(work(job.arrivals)).word[node] = start ? kStart : 0u; }

void resetArrivals(uint node) {
    Quads at = Quads(element(job.binary, node, 64u));
    writeArrivals(node, (at.quad[0].w & at.quad[1].w & kLeaf) != 0u);
}
