// During a build, references to leaves are indices of primitives. Their bounds stay in the scratch memory.
Box keptBox(uint slot) { return readBox(Corners(work(job.boxes)), slot); }
