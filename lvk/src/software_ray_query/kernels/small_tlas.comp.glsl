// A whole top-level structure by one workgroup.
Box smallBox(uint i) { return keepInstance(i); }
