// Nodes of eight children. The inner children of a node are consecutive.
const uint kChildren = 8u;
const uint kWideWords = 20u;

Words wideAt(uint node) { return Words(element(place(job.nodes), node, kWideWords * 4u)); }
