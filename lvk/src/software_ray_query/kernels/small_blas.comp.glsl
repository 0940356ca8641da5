// Sorts the primitives of a whole BLAS by one workgroup.
Box smallBox(uint i) { return inputBox(i); }
