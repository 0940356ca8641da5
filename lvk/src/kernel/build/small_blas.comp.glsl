// A whole bottom-level structure by one workgroup.
Box smallBox(uint i) { return inputBox(i); }

uint smallParts() { return max(max(job.count, job.inputCount), max(job.vertexCount, 1u)); }
