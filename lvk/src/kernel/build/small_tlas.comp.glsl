// A whole top-level structure by one workgroup.
Box smallBox(uint i) { return keepInstance(i); }

uint smallParts() { return max(job.count, 1u); }

void writeTree(uint i) { writeHierarchy(i); }
