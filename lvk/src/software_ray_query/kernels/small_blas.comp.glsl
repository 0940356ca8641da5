// Builds the binary tree of a whole BLAS by one workgroup.
Box smallBox(uint i) { return inputBox(i); }
