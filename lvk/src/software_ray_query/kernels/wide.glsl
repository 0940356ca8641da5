// Nodes of eight children, of which those that are nodes follow each other.
const uint kChildren = 8u;
const uint kWideWords = 20u;

Words wideAt(uint node) { return Words(element(place(job.nodes), node, kWideWords * 4u)); }
