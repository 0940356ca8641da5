// The attachment that light is added to.
#ifdef ONE_PASS
layout(location = 2) out vec4 lit;
#else
layout(location = 0) out vec4 lit;
#endif
