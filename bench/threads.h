/* threads.h - patchsurf's passes and tessellation on ranges, by several threads. */

#ifndef BENCH_THREADS_H_INCLUDED
#define BENCH_THREADS_H_INCLUDED

#include "surface.h"

enum { MAX_TEAM = 16 };

typedef struct frame_times { double construct, tessellate; } frame_times;       /* seconds */

/* Constructs all patches and writes the first t->faces faces to out, frames times over, with size
   threads (this one among them) that wait for each other after every pass. */
void run_team(const tessellation *t, uint32_t size, float *out, frame_times *times, int frames);

#endif
