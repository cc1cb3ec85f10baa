/* bench.h - what the files of the benchmark share.

     bench.c         options, the order of the measures, tables
     kinds.c         tables of what each kind of patch costs
     meshes.c        the meshes
     measure.c       clock, races, the machine, results
     surface.c       patchsurf's stages, and its implementation
     threads.c       the same by several threads
     opensubdiv.cc   OpenSubdiv's stages
     heap.cc         operator new that counts
     compare.c       are the results right, and how far apart are the two surfaces? */

#ifndef BENCH_H_INCLUDED
#define BENCH_H_INCLUDED

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- measure.c ------------------------------------------------------------------------------- */

double now(void);                       /* seconds on the wall, for budgets and several threads */
double work_time(void);                 /* seconds that this thread was at work: what is raced */
void fail(const char *what);            /* prints it; exit status 1: a wrong result */
void *allocate(size_t size);            /* never NULL */
uint32_t random_u32(uint32_t *state);   /* xorshift32; the state must not be 0 */

/* One of those that do the same work. run does it once and returns the seconds that count. */
typedef struct runner {
    const char *name;
    double (*run)(void *what);
    void *what;
    double items;                       /* of one run: faces, points, ... */
    int path;                           /* osd_kind; -1: patchsurf, or no path at all */
    double min, median;                 /* ns per item */
    int runs;
} runner;

runner make_runner(const char *name, double (*run)(void *), void *what, double items);

enum { MAX_RUNNERS = 32, MAX_ROUNDS = 60 };

/* Runs all in turn, round after round, until the seconds are over but at least min_rounds times.
   Within a round each goes on for some milliseconds, so that it finds its own data in the caches
   and not its opponent's. */
void race(runner *runners, int count, double seconds, int min_rounds);

const char *cpu_name(void);
const char *compiler_name(void);
int cpu_count(void);                    /* that this process may run on */

enum { STORE_BYTES = 64 << 20 };        /* of one run of the two below, and of outputs */
double run_memset(void *bytes);
double run_stream(void *bytes);         /* stores past the caches, where the machine has them */
extern const int has_stream;

void progress(const char *what);        /* on a terminal only; NULL: clears the line */

/* Every figure of the run, for the files at its end. */
void note(const char *mesh, uint32_t faces, const char *measure, const char *path,
          const char *unit, double min, double median, int runs);
void write_rows_csv(const char *directory);     /* <directory>/<cpu>-<date>.csv */
void write_rows_json(void *file);               /* the array; file: FILE * */
const char *today(void);

/* ---- meshes.c -------------------------------------------------------------------------------- */

typedef struct mesh {
    const char *name;
    uint32_t vertices, faces, indices;
    uint32_t *face_sizes, *face_vertices;
    float *positions;
} mesh;

typedef enum torus_kind { ORDINARY, FROG_LIKE, TENTH, MIXED } torus_kind;
mesh mesh_torus(torus_kind kind, uint32_t size);        /* of size * size cells */
/* A torus of triangles, all vertices of valence 6: 2 * along * around of them. lumps: the height of
   its lumps, 1 as mesh_torus. */
mesh mesh_triangles(const char *name, uint32_t along, uint32_t around, double lumps);
/* A mesh whose facets are nearly all of one kind of patch: about so many quads, or enough others to
   have as many samples at N = 5. */
mesh mesh_of_kind(int kind, uint32_t quads);
void mesh_free(mesh *m);

/* ---- opensubdiv.cc --------------------------------------------------------------------------- */

/* The ways from a mesh to points of its surface. Tables: adaptive refinement to level 2, stencils
   for control points, patches that are evaluated. */
typedef enum osd_kind {
    OSD_BSPLINE,                        /* tables, B-spline end caps, one table of stencils */
    OSD_GREGORY,                        /* the same, Gregory end caps */
    OSD_BSPLINE_LEVELS,                 /* tables as small as can be: stencils of level on level */
    OSD_GREGORY_LEVELS,
    OSD_BFR,                            /* one Bfr::Surface per face, points kept */
    OSD_LIMIT,                          /* limit stencils for a fixed pattern of samples */
    OSD_UNIFORM,                        /* stencils of a uniform refinement: N = 17 alone */
    OSD_KIND_COUNT,
    OSD_EXACT = OSD_KIND_COUNT          /* Bfr at level 10: the limit, to compare with */
} osd_kind;

typedef struct osd_path osd_path;
typedef struct osd_memory {
    size_t resident;                    /* bytes kept between frames, as the heap rounds them */
    size_t peak;                        /* most bytes held while it was built */
    size_t allocations;
} osd_memory;

const char *osd_name(osd_kind kind);
const char *osd_version(void);
osd_path *osd_open(osd_kind kind, const mesh *m);       /* m: quads only, and kept by address */
void osd_close(osd_path *path);
void osd_drop(osd_path *path);          /* what osd_build made */
void osd_build(osd_path *path);         /* from connectivity to "ready to animate" */
osd_memory osd_build_counted(osd_path *path);
void osd_refresh(osd_path *path);       /* positions of the mesh into control points */
/* Sets the samples: an n * n lattice on each of the first faces, row by row. Returns how many. */
size_t osd_sample(osd_path *path, uint32_t n, uint32_t faces);
void osd_evaluate(osd_path *path, float *out);          /* 6 floats per sample: position, normal */
void osd_positions(osd_path *path, float *out);         /* 3 floats; OSD_UNIFORM: 4 */
/* OSD_UNIFORM: which of its points vertex v of the mesh becomes. */
uint32_t osd_uniform_index(const osd_path *path, uint32_t v);

/* ---- heap.cc --------------------------------------------------------------------------------- */

void heap_count_start(void);            /* from nothing */
osd_memory heap_count(void);            /* of C++ code, since the start */
void heap_count_stop(void);

#ifdef __cplusplus
}
#endif
#endif
