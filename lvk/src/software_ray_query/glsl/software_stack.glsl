#ifndef LVK_SOFTWARE_STACK_GLSL
#define LVK_SOFTWARE_STACK_GLSL

#include <lvk/software_layout.glsl>

// The stack of the running query. Queries take turns: a query that waits with a candidate stores its entries itself.
// The stack contains node groups and single references. Groups are only above `floor`, and then nothing else is above
// it. `top` and `floor` are in units of references.
uvec2 lvkSoftStack[LVK_SOFT_STACK_ENTRIES];

#ifdef LVK_DEVICE_IS_CPU

// lavapipe clears the stack for every eight invocations, so it has half the size here: two references share an entry.
#define LVK_SOFT_GROUP_TAKES 2u

// Returns the number of used entries.
uint lvkSoftEntries(uint top) {
    return (top + 1u) >> 1;
}

void lvkSoftPushGroup(inout uint top, uvec2 group) {
    lvkSoftStack[lvkSoftEntries(top)] = group;
    top += LVK_SOFT_GROUP_TAKES;
}

uvec2 lvkSoftPopGroup(inout uint top) {
    top -= LVK_SOFT_GROUP_TAKES;
    return lvkSoftStack[lvkSoftEntries(top)];
}

void lvkSoftPushReference(inout uint top, uint reference) {
    if ((top & 1u) == 0u) {
        lvkSoftStack[top >> 1].x = reference;
    } else {
        lvkSoftStack[top >> 1].y = reference;
    }
    top += 1u;
}

uint lvkSoftPopReference(inout uint top) {
    top -= 1u;
    uvec2 both = lvkSoftStack[top >> 1];
    return (top & 1u) == 0u ? both.x : both.y;
}

// Returns a group, or a reference with an unspecified second word.
uvec2 lvkSoftPop(inout uint top, bool isGroup) {
    return isGroup ? lvkSoftPopGroup(top) : uvec2(lvkSoftPopReference(top), 0u);
}

#else

uint lvkSoftEntries(uint top) {
    return top;
}

void lvkSoftPushGroup(inout uint top, uvec2 group) {
    lvkSoftStack[top] = group;
    top += 1u;
}

uvec2 lvkSoftPopGroup(inout uint top) {
    top -= 1u;
    return lvkSoftStack[top];
}

void lvkSoftPushReference(inout uint top, uint reference) {
    lvkSoftPushGroup(top, uvec2(reference, 0u));
}

uint lvkSoftPopReference(inout uint top) {
    return lvkSoftPopGroup(top).x;
}

uvec2 lvkSoftPop(inout uint top, bool isGroup) {
    return lvkSoftPopGroup(top);
}

#endif

#endif
