// The binary tree of a whole bottom-level structure by one workgroup.
Box smallBox(uint i) { return inputBox(i); }
