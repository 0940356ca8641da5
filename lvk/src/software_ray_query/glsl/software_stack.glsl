#ifndef LVK_SOFTWARE_STACK_GLSL
#define LVK_SOFTWARE_STACK_GLSL

#include <lvk/software_layout.glsl>

// The stack of the query that is walking. Queries take turns: one that waits with a candidate keeps its entries itself.
// It holds groups of nodes, written as one, and references with nothing beside them; groups only above `floor`, and then
// nothing else. `top` and `floor` count what a reference takes.
uvec2 lvkSoftStack[LVK_SOFT_STACK_ENTRIES];

#ifdef LVK_DEVICE_IS_CPU

// lavapipe clears the stack for every eight invocations, so here it is half as large: two references share an entry.
#define LVK_SOFT_GROUP_TAKES 2u

// Entries in use.
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

// A group, or a reference with anything beside it.
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
