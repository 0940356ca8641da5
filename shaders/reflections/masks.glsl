// Instance masks: light passes through transparent things, so shadow rays do not look for them.
#ifndef REFLECTIONS_MASKS
#define REFLECTIONS_MASKS

const uint kMaskOpaque = 0x01u;
const uint kMaskAll = 0x03u;

#endif
