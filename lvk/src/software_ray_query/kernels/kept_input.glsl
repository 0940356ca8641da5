// While a structure is built, references to leaves are numbers of primitives, whose boxes stay where they were found.
Box keptBox(uint slot) { return readBox(Corners(work(job.boxes)), slot); }
