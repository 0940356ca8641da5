// Boxes of instances stay where they were found.
Box keptBox(uint slot) { return readBox(Floats(work(job.boxes)), slot * 6); }
