/* compare.h - are the results right, and how far apart are the surfaces? */

#ifndef BENCH_COMPARE_H_INCLUDED
#define BENCH_COMPARE_H_INCLUDED

#include "surface.h"

/* Differences of two sets of points and normals. */
typedef struct deviation {
    double max, rms;                    /* positions, percent of the bounding box's diagonal */
    double max_degrees, rms_degrees;    /* normals */
} deviation;

double diagonal(const mesh *m);
/* a, b: [count][6] positions and normals. */
deviation deviation_of(const float *a, const float *b, size_t count, double diagonal);
/* Ends the bench unless every value is finite and every normal a unit vector. stride: floats. */
void check_points(const char *what, const float *p, size_t count, size_t stride);
/* Of a mesh of quads: percent of the samples on edges between two of the first faces that do not
   have the same position, to the bit, on both. p: n * n per face, [6] each. */
double unmet_percent(const mesh *m, const float *p, uint32_t n, uint32_t faces);

#endif
