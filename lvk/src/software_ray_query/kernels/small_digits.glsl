// A single workgroup sorts by four bits a pass.
#define LVK_DIGIT_BITS 4
