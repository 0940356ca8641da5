// Invocations of this kernel read writes of others.
#define LVK_SHARED coherent
