/* compare.c - are the results right, and how far apart are the surfaces? */

#include "compare.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static double dot(const float *a, const float *b)
{
    return (double)a[0] * (double)b[0] + (double)a[1] * (double)b[1] + (double)a[2] * (double)b[2];
}

static double distance(const float *a, const float *b)
{
    const double x = (double)a[0] - (double)b[0], y = (double)a[1] - (double)b[1];
    const double z = (double)a[2] - (double)b[2];
    return sqrt(x * x + y * y + z * z);
}

double diagonal(const mesh *m)
{
    float low[3], high[3];
    size_t i;
    int k;
    memcpy(low, m->positions, sizeof low);
    memcpy(high, m->positions, sizeof high);
    for (i = 0; i < 3 * (size_t)m->vertices; i += 3)
        for (k = 0; k < 3; k++) {
            const float x = m->positions[i + (size_t)k];
            if (x < low[k]) low[k] = x;
            if (x > high[k]) high[k] = x;
        }
    return distance(low, high);
}

deviation deviation_of(const float *a, const float *b, size_t count, double size)
{
    deviation d = { 0, 0, 0, 0 };
    double sum = 0, sum_degrees = 0;
    size_t i;
    for (i = 0; i < 6 * count; i += 6) {
        const double far = distance(a + i, b + i);
        /* by the chord: exact for small angles, too */
        const double chord = distance(a + i + 3, b + i + 3);
        const double degrees = 360 / 3.14159265358979 * asin(chord < 2 ? chord / 2 : 1);
        if (!(far <= d.max)) d.max = far;
        if (!(degrees <= d.max_degrees)) d.max_degrees = degrees;
        sum += far * far;
        sum_degrees += degrees * degrees;
    }
    d.max *= 100 / size;
    d.rms = sqrt(sum / (double)count) * 100 / size;
    d.rms_degrees = sqrt(sum_degrees / (double)count);
    return d;
}

void check_points(const char *what, const float *p, size_t count, size_t stride)
{
    size_t i;
    for (i = 0; i < count; i++, p += stride) {
        const double far = dot(p, p), length = stride == 6 ? dot(p + 3, p + 3) : 1;
        if (far < 1e9 && fabs(length - 1) < 2e-5) continue;
        progress(NULL);
        fprintf(stderr, "bench: %s: point %lu is far off the mesh or not finite, or its normal is "
                "no unit vector\n", what, (unsigned long)i);
        exit(1);
    }
}

/* ---- edges ----------------------------------------------------------------------------------- */

typedef struct half_edge { uint32_t low, high, face, corner; } half_edge;

static int compare_half_edges(const void *a, const void *b)
{
    const half_edge *x = (const half_edge *)a, *y = (const half_edge *)b;
    if (x->low != y->low) return x->low < y->low ? -1 : 1;
    if (x->high != y->high) return x->high < y->high ? -1 : 1;
    return 0;
}

/* Sample i of n along an edge of a quad, in the direction of the face. */
static const float *edge_point(const float *p, uint32_t n, const half_edge *e, uint32_t i)
{
    static const int at[4][2] = { {0, 0}, {1, 0}, {1, 1}, {0, 1} };
    const int *a = at[e->corner], *b = at[(e->corner + 1) % 4];
    const uint32_t last = n - 1;
    const uint32_t x = a[0] == b[0] ? (uint32_t)a[0] * last : a[0] ? last - i : i;
    const uint32_t y = a[1] == b[1] ? (uint32_t)a[1] * last : a[1] ? last - i : i;
    return p + 6 * ((size_t)e->face * n * n + y * n + x);
}

double unmet_percent(const mesh *m, const float *p, uint32_t n, uint32_t faces)
{
    half_edge *edges = (half_edge *)allocate(4 * (size_t)faces * sizeof *edges);
    size_t compared = 0, unmet = 0, i;
    uint32_t k;
    for (i = 0; i < 4 * (size_t)faces; i++) {
        const uint32_t *v = m->face_vertices + i / 4 * 4;
        const uint32_t a = v[i % 4], b = v[(i + 1) % 4];
        edges[i].low = a < b ? a : b;
        edges[i].high = a < b ? b : a;
        edges[i].face = (uint32_t)(i / 4);
        edges[i].corner = i % 4;
    }
    qsort(edges, 4 * (size_t)faces, sizeof *edges, compare_half_edges);
    for (i = 0; i + 1 < 4 * (size_t)faces; i++) {
        if (compare_half_edges(&edges[i], &edges[i + 1])) continue;
        for (k = 0; k < n; k++, compared++)
            unmet += memcmp(edge_point(p, n, &edges[i], k),
                            edge_point(p, n, &edges[i + 1], n - 1 - k), 3 * sizeof(float)) != 0;
    }
    free(edges);
    return compared ? 100.0 * (double)unmet / (double)compared : 0;
}
