/* surface.h - patchsurf's stages as runners. */

#ifndef BENCH_SURFACE_H_INCLUDED
#define BENCH_SURFACE_H_INCLUDED

#include "bench.h"
#include "patchsurf.h"

typedef struct counter { size_t held, peak; unsigned calls; } counter;

typedef struct surface {
    const mesh *m;
    psurf_mesh_desc desc;
    counter memory;                     /* of the first creation of the topology */
    psurf_topology *topology;
    psurf_info info;
    psurf_patches patches;
    psurf_construct_desc construct;
} surface;

void surface_open(surface *s, const mesh *m);   /* scheme pm: built and constructed */
/* The same of any scheme; options: how it is constructed, the positions apart. */
void surface_open_as(surface *s, const mesh *m, psurf_scheme scheme,
                     const psurf_construct_desc *options);
void surface_close(surface *s);
/* Each takes a surface. Per run: all faces, rings or facets. */
double run_build(void *s);              /* connectivity to "ready to animate", and away again */
double run_refresh(void *s);            /* positions into control points */
double run_vertices(void *s);           /* one pass each of that */
double run_facets(void *s);

typedef enum point_normals { NO_NORMALS, SURFACE_NORMALS, SHADING_NORMALS } point_normals;

/* Per face, without indices, interleaved: position and normal, or positions alone. As many faces as
   STORE_BYTES hold, moving on through the mesh from run to run. */
typedef struct tessellation {
    surface *s;
    psurf_tess_desc desc;
    point_normals normals;
    uint32_t first, faces;
    double points;                      /* of a run: with triangles and pentagons, of the first */
    float *out;                         /* [STORE_BYTES / 4] */
} tessellation;

void tessellation_open(tessellation *t, surface *s, uint32_t n, point_normals normals, float *out);
/* As many faces as have no more than so many points, if all have the same number. */
void tessellation_resize(tessellation *t, double points);
void tessellate(const tessellation *t, uint32_t first, uint32_t faces, float *out);
double run_tessellation(void *t);
double run_frame(void *t);              /* psurf_construct of all, then tessellation from face 0 */

#endif
