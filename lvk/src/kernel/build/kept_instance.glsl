// Boxes of instances stay where they were found.
Box keptBox(uint slot) { return readBox(Corners(work(job.boxes)), slot); }
