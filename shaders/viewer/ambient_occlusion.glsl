// Paths of few rays: a direction that is not narrow, as those of mirrors and of glass are, stands for many. Its ray finds the sky, or
// the distance of the surface that hides it, and ambient light takes the place of what comes from there.
#ifndef VIEWER_AMBIENT_OCCLUSION
#define VIEWER_AMBIENT_OCCLUSION

#define AMBIENT_OCCLUSION
// Of narrow directions, per solid angle: highlights have it in their middle up to a roughness of 0.53.
#define LEAST_DENSITY 1.0

#endif
