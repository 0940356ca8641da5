// Sorts the instances of a whole TLAS by one workgroup.
Box smallBox(uint i) { return keepInstance(i); }
