/* bench.c - how long every stage of patchsurf takes on this machine, and how much memory.

       gcc -O3 -I. -DBENCH_FLAGS='"-O3"' bench/bench.c -o build/bench -lm
       build/bench                      tables on standard output, a minute and a half
       build/bench --quick              small meshes, few runs: does everything still work?
       build/bench --csv FILE           the same figures as rows; a FILE that ends in / is a
                                        directory, where <cpu>-<date>.csv is written

   One thread. Every stage runs once to warm up, then as often as its share of time allows: the
   tables give the fastest and the median run. Outputs are checked in the same process: figures of
   wrong results are worth nothing. bench/README.md says what the figures mean. */

#if !defined(_POSIX_C_SOURCE)
#define _POSIX_C_SOURCE 200809L         /* clock_gettime, isatty */
#endif

#define PSURF_IMPLEMENTATION
#include "patchsurf.h"

#include <ctype.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#ifndef BENCH_FLAGS
#define BENCH_FLAGS "not given (define BENCH_FLAGS)"
#endif

enum {
    OUTPUT_BYTES = 64 << 20,            /* of one tessellation call: well beyond most caches */
    EVAL_SAMPLES = 1 << 16,
    MAX_RUNS = 200,
    ROWS = 11                           /* per mesh, for the progress display */
};

static void fail(const char *what)
{
    fprintf(stderr, "\nbench: %s\n", what);
    exit(1);
}

static void *allocate(size_t size)
{
    void *memory = malloc(size ? size : 1);
    if (!memory) fail("out of memory");
    return memory;
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static uint32_t random_state = 1;
static uint32_t random_u32(void)        /* xorshift32 */
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 17;
    random_state ^= random_state << 5;
    return random_state;
}
static float random_unit(void) { return (float)(random_u32() >> 8) / 16777216.0f; }

/* ---- meshes: a lumpy torus, made of tiles of 4 x 4 cells ------------------------------------- */

typedef enum mesh_kind { ALL_ORDINARY, FROG_LIKE, MIXED } mesh_kind;
static const char *const mesh_names[] = { "ordinary", "frog-like", "mixed" };

typedef struct mesh {
    mesh_kind kind;
    uint32_t size;                      /* cells along and around */
    uint32_t vertices, faces, indices;
    uint32_t *face_sizes, *face_vertices;
    float *positions;
} mesh;

/* Vertex of the grid, both directions wrapped. */
static uint32_t grid(const mesh *m, uint32_t x, uint32_t y)
{
    return y % m->size * m->size + x % m->size;
}

static void place(mesh *m, uint32_t vertex, double x, double y)
{
    double turn = 6.283185307179586 / m->size;
    double a = x * turn, b = y * turn;
    double tube = 0.5 + 0.06 * sin(7.0 * a) * cos(5.0 * b) + 0.03 * cos(13.0 * (a + b));
    float *p = m->positions + 3 * (size_t)vertex;
    p[0] = (float)((1.5 + tube * cos(b)) * cos(a));
    p[1] = (float)((1.5 + tube * cos(b)) * sin(a));
    p[2] = (float)(tube * sin(b));
}

static void add_face(mesh *m, uint32_t n, uint32_t a, uint32_t b, uint32_t c, uint32_t d,
                     uint32_t e)
{
    uint32_t corners[5];
    corners[0] = a; corners[1] = b; corners[2] = c; corners[3] = d; corners[4] = e;
    memcpy(m->face_vertices + m->indices, corners, n * sizeof *corners);
    m->face_sizes[m->faces++] = n;
    m->indices += n;
}

static void add_cell(mesh *m, uint32_t x, uint32_t y)
{
    add_face(m, 4, grid(m, x, y), grid(m, x + 1, y), grid(m, x + 1, y + 1), grid(m, x, y + 1), 0);
}

/* Two quads side by side whose common edge is turned: vertices of valence 3, 3, 5, 5, which 10 of
   the 16 quads of the tile touch. */
static void add_turned_edge(mesh *m, uint32_t x, uint32_t y)
{
    uint32_t a = grid(m, x, y), b = grid(m, x + 1, y), c = grid(m, x + 2, y);
    uint32_t d = grid(m, x + 2, y + 1), e = grid(m, x + 1, y + 1), f = grid(m, x, y + 1);
    add_face(m, 4, f, a, b, c, 0);
    add_face(m, 4, c, d, e, f, 0);
}

/* A quad cut in two by an edge that ends in T-corners: its neighbours become pentagons. */
static void add_t_corners(mesh *m, uint32_t x, uint32_t y)
{
    uint32_t left = m->vertices++, right = m->vertices++;
    place(m, left, x + 1, y + 0.5);
    place(m, right, x + 2, y + 0.5);
    add_face(m, 5, grid(m, x, y), grid(m, x + 1, y), left, grid(m, x + 1, y + 1),
             grid(m, x, y + 1));
    add_face(m, 4, grid(m, x + 1, y), grid(m, x + 2, y), right, left, 0);
    add_face(m, 4, left, right, grid(m, x + 2, y + 1), grid(m, x + 1, y + 1), 0);
    add_face(m, 5, grid(m, x + 2, y), grid(m, x + 3, y), grid(m, x + 3, y + 1),
             grid(m, x + 2, y + 1), right);
}

static void add_triangles(mesh *m, uint32_t x, uint32_t y)
{
    uint32_t a = grid(m, x, y), c = grid(m, x + 1, y + 1);
    add_face(m, 3, a, grid(m, x + 1, y), c, 0, 0);
    add_face(m, 3, c, grid(m, x, y + 1), a, 0, 0);
}

static void add_tile(mesh *m, uint32_t tile, uint32_t x0, uint32_t y0)
{
    int turned = m->kind == FROG_LIKE && tile % 25 != 24;    /* 24/25 of 10/16: 60 % of the quads */
    uint32_t x, y;
    for (y = 0; y < 4; y++)
        for (x = 0; x < 4; x++) {
            if (turned && y == 1 && (x == 1 || x == 2)) {
                if (x == 1) add_turned_edge(m, x0 + x, y0 + y);
            } else if (m->kind == MIXED && y == 0 && x < 3) {
                if (x == 0) add_t_corners(m, x0, y0);
            } else if (m->kind == MIXED && y == 2 && (x == 1 || x == 2)) {
                add_triangles(m, x0 + x, y0 + y);
            } else {
                add_cell(m, x0 + x, y0 + y);
            }
        }
}

static mesh mesh_make(mesh_kind kind, uint32_t size)
{
    mesh m;
    uint32_t tiles = size / 4, max_faces = tiles * tiles * 19, i;
    memset(&m, 0, sizeof m);
    m.kind = kind;
    m.size = tiles * 4;
    m.vertices = m.size * m.size;
    m.face_sizes = (uint32_t *)allocate(max_faces * sizeof(uint32_t));
    m.face_vertices = (uint32_t *)allocate(max_faces * 5 * sizeof(uint32_t));
    m.positions = (float *)allocate((m.vertices + 2 * tiles * tiles) * 3 * sizeof(float));
    for (i = 0; i < m.size * m.size; i++) place(&m, i, i % m.size, i / m.size);
    for (i = 0; i < tiles * tiles; i++) add_tile(&m, i, i % tiles * 4, i / tiles * 4);
    return m;
}

static void mesh_free(mesh *m)
{
    free(m->face_sizes);
    free(m->face_vertices);
    free(m->positions);
}

/* ---- an allocator that counts ---------------------------------------------------------------- */

typedef struct counter { size_t held, peak; unsigned calls; } counter;

static void *counted_alloc(void *ctx, size_t size, size_t align)
{
    counter *c = (counter *)ctx;
    (void)align;                        /* at most 16: malloc's own on the machines benched */
    c->calls++;
    c->held += size;
    if (c->held > c->peak) c->peak = c->held;
    return malloc(size);
}

static void counted_release(void *ctx, void *memory, size_t size)
{
    ((counter *)ctx)->held -= size;
    free(memory);
}

/* ---- what is measured: a run does one stage once and returns its seconds per item ------------ */

typedef struct job {
    mesh m;
    psurf_mesh_desc desc;
    counter memory;
    psurf_topology *topology;
    psurf_info info;
    psurf_patches patches;
    psurf_construct_desc construct;
    psurf_tess_desc tess;               /* of the row being measured, with the four below */
    int normals;
    uint32_t first_face, face_count;    /* moves on from run to run */
    size_t points;                      /* written by the last run */
    uint32_t *index;                    /* NULL: no indices */
    float *p, *n;                       /* OUTPUT_BYTES in all, p first, n behind it */
    psurf_sample *samples;              /* [EVAL_SAMPLES] at random */
    float *derivatives;                 /* 5 x [EVAL_SAMPLES][3] */
} job;

typedef double run_function(job *j);

static double run_topology(job *j)
{
    psurf_topology *topology;
    double start = now(), end;
    if (psurf_topology_create(&j->desc, &topology, NULL)) fail("topology was refused");
    end = now();
    psurf_topology_destroy(topology);
    return (end - start) / j->m.faces;
}

static double run_pass(job *j, psurf_pass pass)
{
    double start = now();
    if (psurf_construct_pass(&j->patches, &j->construct, pass, 0, UINT32_MAX))
        fail("construction failed");
    return (now() - start) / j->m.faces;
}
static double run_vertices(job *j) { return run_pass(j, PSURF_PASS_VERTICES); }
static double run_facets(job *j) { return run_pass(j, PSURF_PASS_FACETS); }

static double run_tessellate(job *j)
{
    psurf_tess_span span;
    psurf_tess_out out;
    double start, end;
    int per_face = (j->tess.flags & PSURF_TESS_PER_FACE) != 0;
    uint32_t first = per_face ? j->first_face : 0, count = per_face ? j->face_count : j->m.faces;
    if (psurf_tessellate_size(j->topology, &j->tess, first, count, &span))
        fail("tessellation was refused");
    memset(&out, 0, sizeof out);
    out.p = j->p;
    out.n = j->normals ? j->n : NULL;
    out.indices = j->index;
    out.first_vertex = span.first_vertex;
    out.first_index = span.first_index;
    start = now();
    if (psurf_tessellate(&j->patches, &j->tess, first, count, &out)) fail("tessellation failed");
    end = now();
    j->points = span.vertex_count;
    j->first_face = first + 2 * count <= j->m.faces ? first + count : 0;
    return (end - start) / span.vertex_count;
}

static double run_eval(job *j, int derivatives)
{
    psurf_points out;
    double start;
    float *d = j->derivatives;
    size_t step = (size_t)EVAL_SAMPLES * 3;
    memset(&out, 0, sizeof out);
    out.p = j->p;
    out.n = j->n;
    if (derivatives) {
        out.du = d;
        out.dv = d + step;
        out.duu = d + 2 * step;
        out.duv = d + 3 * step;
        out.dvv = d + 4 * step;
    }
    start = now();
    psurf_eval(&j->patches, j->samples, EVAL_SAMPLES, &out);
    return (now() - start) / EVAL_SAMPLES;
}
static double run_eval_pn(job *j) { return run_eval(j, 0); }
static double run_eval_all(job *j) { return run_eval(j, 1); }

/* ---- runs and their statistics --------------------------------------------------------------- */

typedef struct timing { double min, median; int runs; } timing;

static double budget = 0.4;             /* seconds per row */

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static timing measure(run_function *run, job *j)
{
    double seconds[MAX_RUNS], start;
    timing t;
    int n = 0;
    run(j);
    start = now();
    do seconds[n++] = run(j);
    while (n < MAX_RUNS && (n < 5 || now() - start < budget));
    qsort(seconds, (size_t)n, sizeof *seconds, compare_doubles);
    t.min = seconds[0];
    t.median = n % 2 ? seconds[n / 2] : 0.5 * (seconds[n / 2 - 1] + seconds[n / 2]);
    t.runs = n;
    return t;
}

/* ---- the machine ----------------------------------------------------------------------------- */

static void trim(char *text)
{
    size_t n = strlen(text);
    while (n && (text[n - 1] == '\n' || text[n - 1] == ' ')) text[--n] = 0;
}

static const char *cpu_name(void)
{
    static char name[128] = "unknown processor";
    char line[256];
    FILE *f = fopen("/proc/cpuinfo", "r");
    if (!f) return name;
    while (fgets(line, sizeof line, f))
        if (!strncmp(line, "model name", 10) && strchr(line, ':')) {
            snprintf(name, sizeof name, "%.*s", (int)sizeof name - 1, strchr(line, ':') + 2);
            trim(name);
            break;
        }
    fclose(f);
    return name;
}

static const char *compiler_name(void)
{
#if defined(__clang__)
    return "clang " __clang_version__;
#elif defined(__GNUC__)
    return "gcc " __VERSION__;
#else
    return "unknown compiler";
#endif
}

static double run_memset(job *j)
{
    double start = now();
    memset(j->p, (int)(random_u32() & 255u), OUTPUT_BYTES);
    return (now() - start) / OUTPUT_BYTES;
}

/* Stores past the caches, as a tessellation written front to back can: the fastest there is. */
static double run_stream(job *j)
{
#if defined(__SSE2__)
    double start = now();
    __m128 value = _mm_set1_ps(random_unit());
    size_t i;
    for (i = 0; i < OUTPUT_BYTES / sizeof(float); i += 4) _mm_stream_ps(j->p + i, value);
    _mm_sfence();
    return (now() - start) / OUTPUT_BYTES;
#else
    return run_memset(j);
#endif
}

/* ---- results --------------------------------------------------------------------------------- */

static FILE *csv;
static char date[16];
static int step_now, step_count, on_terminal;

static void progress(const job *j, const char *what)
{
    if (!on_terminal) return;
    fprintf(stderr, "\r\033[K[%3d %%] %s, %u faces: %s", 100 * step_now / step_count,
            mesh_names[j->m.kind], (unsigned)j->m.faces, what);
    fflush(stderr);
    step_now++;
}

static void progress_end(void)
{
    if (on_terminal) fprintf(stderr, "\r\033[K");
}

static void csv_open(const char *path)
{
    char name[512];
    size_t i;
    if (path[0] && path[strlen(path) - 1] == '/') {
        snprintf(name, sizeof name, "%s%s-%s.csv", path, cpu_name(), date);
        for (i = strlen(path); name[i]; i++)
            if (!isalnum((unsigned char)name[i]) && name[i] != '-' && name[i] != '.') name[i] = '_';
        mkdir(path, 0777);              /* it may exist: opening the file tells */
        path = name;
    }
    csv = fopen(path, "w");
    if (!csv) {
        fprintf(stderr, "bench: cannot write %s\n", path);
        exit(2);
    }
    fprintf(csv, "date,cpu,compiler,flags,version,mesh,faces,measure,unit,min,median,runs\n");
}

/* j: NULL for a figure that belongs to no mesh. Times in ns. */
static void csv_row(const job *j, const char *what, const char *unit, double min, double median,
                    int runs)
{
    if (!csv) return;
    fprintf(csv, "%s,\"%s\",\"%s\",\"%s\",%u,%s,%u,%s,%s,%.4g,%.4g,%d\n", date, cpu_name(),
            compiler_name(), BENCH_FLAGS, (unsigned)psurf_version(),
            j ? mesh_names[j->m.kind] : "", j ? (unsigned)j->m.faces : 0, what, unit, min, median,
            runs);
}

static double store_rate;               /* bytes per second, the better of both */

static void measure_stores(job *j)
{
    timing set = measure(run_memset, j), stream = measure(run_stream, j);
    store_rate = 1 / (stream.min < set.min ? stream.min : set.min);
    printf("store bandwidth, 64 MiB: memset %.1f GB/s", 1e-9 / set.min);
#if defined(__SSE2__)
    printf(", non-temporal %.1f GB/s", 1e-9 / stream.min);
#endif
    printf("\n");
    csv_row(NULL, "store: memset", "byte", 1e9 * set.min, 1e9 * set.median, set.runs);
    csv_row(NULL, "store: non-temporal", "byte", 1e9 * stream.min, 1e9 * stream.median,
            stream.runs);
}

/* One line of the table, in ns. bytes: stored per item, 0 = no bandwidth. target: see README.md,
   0 = none. */
static timing row(job *j, const char *name, run_function *run, const char *unit, size_t bytes,
                  double target)
{
    timing t;
    progress(j, name);
    t = measure(run, j);
    t.min *= 1e9;
    t.median *= 1e9;
    progress_end();
    printf("  %-26s %9.2f %9.2f  ns/%-5s", name, t.min, t.median, unit);
    if (target > 0) printf(" %7.1f", target);
    else printf("        ");
    if (bytes) {
        double rate = (double)bytes / t.min * 1e9;
        printf(" %7.2f GB/s %5.1f %%", 1e-9 * rate, 100 * rate / store_rate);
    }
    printf("\n");
    csv_row(j, name, unit, t.min, t.median, t.runs);
    return t;
}

/* ---- are the results right? ------------------------------------------------------------------ */

/* n: NULL to check positions alone */
static void check_points(const char *what, const float *p, const float *n, size_t count)
{
    size_t i;
    for (i = 0; i < 3 * count; i += 3) {
        const double far = fabs((double)p[i]) + fabs((double)p[i + 1]) + fabs((double)p[i + 2]);
        double square = 1;
        if (n) square = (double)n[i] * (double)n[i] + (double)n[i + 1] * (double)n[i + 1] +
                        (double)n[i + 2] * (double)n[i + 2];
        if (far < 6 && fabs(square - 1) < 2e-5) continue;
        fprintf(stderr, "\nbench: %s: a point is far off the mesh or not finite, or its normal is "
                "no unit vector\n", what);
        exit(1);
    }
}

/* Tessellation and evaluation at the same places must agree, wherever their code differs. */
static void check_against_eval(job *j)
{
    psurf_tess_span span;
    psurf_tess_out out;
    psurf_points points;
    psurf_sample *where;
    float *values;
    size_t i, count;
    uint32_t faces = j->m.faces < 500 ? j->m.faces : 500;
    if (psurf_tessellate_size(j->topology, &j->tess, 0, faces, &span)) fail("size was refused");
    count = span.vertex_count;
    where = (psurf_sample *)allocate(count * sizeof *where);
    values = (float *)allocate(count * 12 * sizeof *values);
    memset(&out, 0, sizeof out);
    out.p = values;
    out.n = values + count * 3;
    out.where = where;
    if (psurf_tessellate(&j->patches, &j->tess, 0, faces, &out)) fail("tessellation failed");
    memset(&points, 0, sizeof points);
    points.p = values + count * 6;
    points.n = values + count * 9;
    psurf_eval(&j->patches, where, (uint32_t)count, &points);
    for (i = 0; i < count * 6; i++)
        if (!(fabs((double)values[i] - (double)values[i + count * 6]) < 1e-4))
            fail("tessellation and evaluation differ by more than 1e-4");
    free(where);
    free(values);
}

/* ---- one mesh -------------------------------------------------------------------------------- */

/* Quads touching an extraordinary vertex are those without an ordinary patch. */
static void print_mesh(const job *j)
{
    int k;
    printf("\n%s: %u faces, %u vertices:", mesh_names[j->m.kind], (unsigned)j->m.faces,
           (unsigned)j->m.vertices);
    for (k = 0; k < PSURF_KIND_COUNT; k++)
        if (j->info.kind_faces[k])
            printf(" %u %s (%.0f %%)", (unsigned)j->info.kind_faces[k],
                   psurf_kind_name((psurf_kind)k), 100.0 * j->info.kind_faces[k] / j->m.faces);
    printf("\n  %-26s %9s %9s  %-8s %7s %12s  of store\n", "", "min", "median", "", "target",
           "stored");
}

static void job_open(job *j, mesh_kind kind, uint32_t size)
{
    uint32_t i;
    j->m = mesh_make(kind, size);
    memset(&j->desc, 0, sizeof j->desc);
    j->desc.vertex_count = j->m.vertices;
    j->desc.face_count = j->m.faces;
    j->desc.face_sizes = j->m.face_sizes;
    j->desc.face_vertices = j->m.face_vertices;
    j->desc.allocator.alloc = counted_alloc;
    j->desc.allocator.release = counted_release;
    j->desc.allocator.ctx = &j->memory;
    memset(&j->memory, 0, sizeof j->memory);
    if (psurf_topology_create(&j->desc, &j->topology, NULL)) fail("topology was refused");
    psurf_topology_info(j->topology, &j->info);
    if (psurf_patches_size(j->topology, PSURF_PM, &j->patches.layout)) fail("size was refused");
    if (psurf_patches_bind(&j->patches, j->topology, PSURF_PM,
                           allocate(j->patches.layout.patch_bytes),
                           allocate(j->patches.layout.scratch_bytes)))
        fail("memory was refused");
    memset(&j->construct, 0, sizeof j->construct);
    j->construct.positions = j->m.positions;
    if (psurf_construct(&j->patches, &j->construct)) fail("construction failed");
    memset(&j->tess, 0, sizeof j->tess);
    for (i = 0; i < EVAL_SAMPLES; i++) {
        j->samples[i].face = random_u32() % j->m.faces;
        j->samples[i].sector = random_u32() % 5;
        j->samples[i].u = random_unit();
        j->samples[i].v = random_unit() * (1 - j->samples[i].u);
    }
}

static void job_close(job *j)
{
    psurf_topology_destroy(j->topology);
    if (j->memory.held) fail("the topology left memory behind");
    free(j->patches.patches);
    free(j->patches.scratch);
    mesh_free(&j->m);
}

/* Sets up a tessellation row: as many faces as the output memory holds. */
static void choose_tessellation(job *j, uint32_t rate, uint32_t flags, int normals)
{
    psurf_tess_span span;
    size_t most = OUTPUT_BYTES / (24 * (size_t)(rate + 1) * (rate + 1));
    j->tess.rate = rate;
    j->tess.flags = flags;
    j->normals = normals;
    j->first_face = 0;
    j->face_count = j->m.faces;
    if (j->m.kind == MIXED) most = most * 2 / 3;        /* pentagons have more points than quads */
    if (j->face_count > most) j->face_count = (uint32_t)most;
    if (psurf_tessellate_size(j->topology, &j->tess, 0, j->face_count, &span) ||
        (size_t)span.vertex_count * 24 > OUTPUT_BYTES)
        fail("a tessellation does not fit its memory");
}

static void tessellate_rows(job *j, timing tess[4])
{
    static const double target_any[4] = { 4.2, 2.9, 2.4, 2.4 };
    static const double target_bicubic[4] = { 3.2, 2.2, 1.9, 1.9 };
    char name[64];
    uint32_t i;
    for (i = 0; i < 4; i++) {
        choose_tessellation(j, 4u << i, PSURF_TESS_PER_FACE, 1);
        snprintf(name, sizeof name, "P+N rate %u (N=%u)", (unsigned)(4u << i),
                 (unsigned)((4u << i) + 1));
        tess[i] = row(j, name, run_tessellate, "point", 24,
                      j->m.kind == ALL_ORDINARY ? target_bicubic[i] : target_any[i]);
        check_points(name, j->p, j->n, j->points);
        check_against_eval(j);
        tess[i].min *= (double)j->points / j->face_count;       /* per face, for the shares */
    }
    choose_tessellation(j, 16, PSURF_TESS_PER_FACE, 0);
    row(j, "P rate 16 (N=17)", run_tessellate, "point", 12, 1.5);
    check_points("P", j->p, NULL, j->points);
}

/* The whole mesh welded and with indices, as a program that draws or exports it wants it. */
static void welded_row(job *j)
{
    psurf_tess_span span;
    choose_tessellation(j, 4, 0, 1);
    if (psurf_tessellate_size(j->topology, &j->tess, 0, j->m.faces, &span) ||
        (size_t)span.vertex_count * 24 > OUTPUT_BYTES)
        fail("the welded mesh does not fit its memory");
    j->index = (uint32_t *)allocate(span.index_count * sizeof(uint32_t));
    row(j, "welded+indices rate 4", run_tessellate, "point", 0, 0);
    check_points("welded", j->p, j->n, j->points);
    free(j->index);
    j->index = NULL;
}

/* Shares of the time of one frame, at the four rates of tess (ns per face). */
static void print_shares(const timing *vertices, const timing *facets, const timing tess[4])
{
    static const char *const names[3] = { "vertices", "facets", "points" };
    int stage, i;
    printf("  %-22s %8s %8s %8s %8s\n", "a frame of P+N:", "rate 4", "rate 8", "rate 16",
           "rate 32");
    for (stage = 0; stage < 3; stage++) {
        printf("    %-20s", names[stage]);
        for (i = 0; i < 4; i++) {
            const double all = vertices->min + facets->min + tess[i].min;
            const timing *part = stage == 0 ? vertices : stage == 1 ? facets : &tess[i];
            printf(" %6.1f %%", 100 * part->min / all);
        }
        printf("\n");
    }
}

static void print_memory(const job *j)
{
    double faces = j->m.faces, topology = (double)j->info.bytes / faces;
    double patches = (double)j->patches.layout.patch_bytes / faces;
    double scratch = (double)j->patches.layout.scratch_bytes / faces;
    double peak = (double)j->memory.peak / faces;
    printf("  bytes/face: topology %.0f + patches %.0f = %.0f (target 400), scratch %.0f (130), "
           "peak heap %.0f (600), %u allocations (8)\n", topology, patches, topology + patches,
           scratch, peak, j->memory.calls);
    csv_row(j, "topology", "byte/face", topology, topology, 1);
    csv_row(j, "patches", "byte/face", patches, patches, 1);
    csv_row(j, "scratch", "byte/face", scratch, scratch, 1);
    csv_row(j, "peak heap", "byte/face", peak, peak, 1);
    csv_row(j, "allocations", "call", j->memory.calls, j->memory.calls, 1);
}

static void bench_mesh(job *j, mesh_kind kind, uint32_t size)
{
    timing vertices, facets, tess[4];
    counter memory;
    job_open(j, kind, size);
    memory = j->memory;                 /* of one creation, before the measured ones */
    print_mesh(j);
    row(j, "topology", run_topology, "face", 0, 300);
    j->memory = memory;
    vertices = row(j, "construct: vertices", run_vertices, "face", 0, 0);
    facets = row(j, "construct: facets", run_facets, "face",
                 j->patches.layout.patch_bytes / j->m.faces, 0);
    printf("  %-26s %9.2f %9.2f  ns/face  %7.1f\n", "construct: both",
           vertices.min + facets.min, vertices.median + facets.median, 60.0);
    tessellate_rows(j, tess);
    welded_row(j);
    row(j, "eval P+N, random", run_eval_pn, "point", 0, 0);
    row(j, "eval P..Dvv, random", run_eval_all, "point", 0, 0);
    check_points("eval", j->p, j->n, EVAL_SAMPLES);
    print_shares(&vertices, &facets, tess);
    print_memory(j);
    job_close(j);
}

int main(int argc, char **argv)
{
    static const uint32_t sizes[3][3] = { { 36, 100, 316 }, { 36, 100, 316 }, { 32, 92, 288 } };
    const char *csv_path = NULL;
    time_t today = time(NULL);
    int i, kind, size, quick = 0;
    job j;
    for (i = 1; i < argc; i++) {
        if (!strcmp(argv[i], "--quick")) quick = 1;
        else if (!strcmp(argv[i], "--csv") && i + 1 < argc) csv_path = argv[++i];
        else {
            fprintf(stderr, "usage: bench [--quick] [--csv FILE or DIRECTORY/]\n");
            return 2;
        }
    }
    if (quick) budget = 0.01;
    strftime(date, sizeof date, "%Y-%m-%d", gmtime(&today));
    if (csv_path) csv_open(csv_path);
    on_terminal = isatty(2);
    step_count = ROWS * 3 * (quick ? 1 : 3);
    memset(&j, 0, sizeof j);
    j.p = (float *)allocate(OUTPUT_BYTES);
    j.n = j.p + OUTPUT_BYTES / 2 / sizeof(float);
    j.samples = (psurf_sample *)allocate(EVAL_SAMPLES * sizeof *j.samples);
    j.derivatives = (float *)allocate((size_t)EVAL_SAMPLES * 15 * sizeof(float));

    printf("patchsurf %d.%d.%d, %s%s\ncompiler %s, flags %s\n", PSURF_VERSION_MAJOR,
           PSURF_VERSION_MINOR, PSURF_VERSION_PATCH, cpu_name(),
           psurf_exact() ? "" : " (this build promises no identical bits)", compiler_name(),
           BENCH_FLAGS);
    measure_stores(&j);
    for (kind = 0; kind < 3; kind++)
        for (size = 0; size < (quick ? 1 : 3); size++)
            bench_mesh(&j, (mesh_kind)kind, sizes[kind][size]);
    free(j.p);
    free(j.samples);
    free(j.derivatives);
    if (csv && fclose(csv)) fail("the csv file is incomplete");
    return 0;
}
