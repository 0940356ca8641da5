// A workgroup of clustering holds as many clusters as it has invocations, and its masks have a bit for each.
#define LVK_GROUP 32
