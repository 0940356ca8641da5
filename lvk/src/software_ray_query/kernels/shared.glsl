// Invocations of this kernel read what others wrote.
#define LVK_SHARED coherent
