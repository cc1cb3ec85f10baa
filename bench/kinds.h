/* kinds.h - what each kind of patch costs, and Table 2 of [A], which is [GB] in patchsurf.h. */

#ifndef BENCH_KINDS_H_INCLUDED
#define BENCH_KINDS_H_INCLUDED

#include "bench.h"

typedef struct plan {
    double seconds;                     /* per race */
    int rounds;                         /* at least */
    float *out, *again;                 /* [STORE_BYTES / 4] each */
} plan;

/* Meshes that consist of one kind of patch each: about so many quads, or others with as many
   samples. */
void run_kinds(const plan *p, uint32_t quads);
/* A mesh of 1000 triangles: construction and exact normals, beside what the paper printed. */
void run_table2(const plan *p);
/* Members of an object: the costs of a point in those of a bicubic one, and so on. file: FILE * */
void write_kinds_json(void *file);

#endif
